"""Results against a truth: a rendered one or a hand-tracked table."""
