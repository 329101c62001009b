// Makes elements of the page, with attributes and children: text, or further elements.
export function element<Tag extends keyof HTMLElementTagNameMap>(tag: Tag, attributes: Record<string, string | number> = {}, ...children: (Node | string)[]) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
  made.append(...children);
  return made;
}
