"""What the public interface promises: arguments, errors, files, names, units and pictures."""
