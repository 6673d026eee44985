"""A bake in items, on any number of machines: a plan, its items baked apart, and the whole put together."""
