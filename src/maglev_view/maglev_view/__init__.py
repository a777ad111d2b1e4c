"""The stage on standard topics and in the browser. Watches only: no flight depends on it."""
