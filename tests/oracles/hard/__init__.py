"""Hard cases: scenes that break bakers, each with what is right, for a test (tests/hard) and for a page of pictures."""
