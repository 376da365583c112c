"""A workpiece in equal cells over its layered stock: finite cells, which need no mesh."""
