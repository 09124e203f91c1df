"""Models as machine code: a traced model becomes one loop over scalars, for many states or for one."""
