"""A whole unit on a table whose axes are read: rests and turns of all channels as one problem."""
