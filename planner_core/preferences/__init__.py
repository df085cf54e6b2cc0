"""What operators like beside worth: secondary aims that never cost any."""
