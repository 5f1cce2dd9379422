"""Laws to compare with, registered as laws of users are."""
