/* One line a shape: its const struct shape_ops is shape_ops_NAME. */
SHAPE(obj)
SHAPE(rectangle)
SHAPE(cube)
SHAPE(sphere)
