"""chipload plans and proves CNC milling of the parts that are hard to mill."""
