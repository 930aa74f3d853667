"""What is visible on a matplotlib picture."""


def legend_words(ax) -> list[str]:
    """The words of the legend of an Axes in the order in which they are read: row by row, from left to right."""
    ax.figure.draw_without_rendering()
    texts = ax.get_legend().get_texts()
    left = {text: text.get_transform().transform(text.get_position()) for text in texts}
    return [text.get_text() for text in sorted(texts, key=lambda text: (-round(left[text][1]), left[text][0]))]
