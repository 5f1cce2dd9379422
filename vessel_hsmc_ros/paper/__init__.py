"""The paper's cases run, measured, drawn and held against what the paper says of them."""
