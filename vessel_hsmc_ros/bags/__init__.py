"""MCAP bags: written, scanned, repaired, read by columns."""
