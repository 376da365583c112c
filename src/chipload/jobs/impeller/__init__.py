"""The result of milling an impeller in sections: what a person reads of it."""
