"""The panels of the page; each shows a track and follows its row."""

#: what is done in the browser when a list closes or the slider is let go: the keys are the page's again
RELEASE = "() => document.activeElement && document.activeElement.blur()"
