"""What a run tells of its state: snapshots for ParaView, energies, entries of the report."""
