"""Standard manoeuvres of any ship: their scenarios, their metrics as IMO resolution MSC.137(76) defines them, a page."""
