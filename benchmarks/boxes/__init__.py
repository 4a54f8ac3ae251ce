"""Black boxes whose gradients are known to be right or wrong: what `routes check` is measured against."""
