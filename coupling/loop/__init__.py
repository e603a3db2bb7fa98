"""The coupling loop: windows, schemes, relaxation, length of the windows."""
