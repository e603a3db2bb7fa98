"""What a run leaves in its folder: history, report, ParaView files; and what it shows meanwhile."""
