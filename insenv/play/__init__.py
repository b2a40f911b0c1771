"""An environment in the browser: a person or a policy gives the commands, and the belief shrinks.

    scene (what a person sees and sets)  ->  session (one run, stepped in time)  ->  server (pages on 127.0.0.1)

A system's own scene stands in its folder (`insenv.core.system.System.scene`); any other is played with a slider for
each number of its action.
"""
