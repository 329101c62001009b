// Makes and finds elements of the page.
export const byId = <T extends HTMLElement = HTMLElement>(id: string) => document.getElementById(id) as T;
export const input = (id: string) => byId<HTMLInputElement>(id);
export const isOn = (id: string) => input(id).checked;
export const mode = (value: "push" | "pull" | "scalpel") => document.querySelector<HTMLInputElement>(`input[name="mode"][value="${value}"]`)!;

// With attributes and children: text, or further elements.
export function element<Tag extends keyof HTMLElementTagNameMap>(tag: Tag, attributes: Record<string, string | number> = {}, ...children: (Node | string)[]) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
  made.append(...children);
  return made;
}
