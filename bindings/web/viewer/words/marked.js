// The HTML of a word: `code` and [key].
/** @param {string} word */
export const marked = (word) => word.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/`([^`]+)`/g, "<code>$1</code>").replace(/\[([^\]]+)\]/g, "<kbd>$1</kbd>");
