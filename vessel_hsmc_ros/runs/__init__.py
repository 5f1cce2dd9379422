"""One run: offline or by the nodes, verified, run again, compared."""
