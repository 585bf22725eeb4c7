"""What a packing measured at rest differs from one measured at full speed."""
