"""The script that makes the references is run by hand, not collected."""

collect_ignore = ["reference"]
