"""Whether answers depend on when they were given."""
