"""Element sets, propagation, frames, sun and shadow."""
