"""What operators prefer besides worth: secondary aims that never cost any worth."""
