"""A server of the Model Context Protocol over stdin and stdout, for programs that work with chipload as people do.

It reads and writes only in the folders that are named when it starts.
"""
