"""What is right: exact answers, hard cases, a second opinion, and how the estimators come near them."""
