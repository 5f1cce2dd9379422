"""Verbs of the command `vessel-hsmc`, one file each."""
