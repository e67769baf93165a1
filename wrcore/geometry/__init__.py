"""Where the surfaces are: profiles, track, wheel and rail surfaces."""
