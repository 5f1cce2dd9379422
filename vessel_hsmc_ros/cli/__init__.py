"""The command vessel-hsmc, one verb a file."""
