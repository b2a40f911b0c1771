"""What a terminal shows: its width and colours, how far long work is."""
