"""The laws of sliding: motion, friction and wear."""
