/** An element of the page. */
export function element<T extends HTMLElement = HTMLElement>(id: string): T {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no #${id}`);
  return found as T;
}

const KEYS: readonly [string, string][] = [
  ['W A S D', 'walk; Shift: faster'],
  ['Arrows, mouse', 'look around; drag, or L to lock the mouse'],
  ['Space, C', 'up, down'],
  ['E, click', 'open or shut the door ahead'],
  ['V', 'walls stop the eye, or not'],
  ['M', 'plan; a click goes there'],
  ['1 to 5', 'cull nothing, by frustum, portals, rows (PVS), both'],
  ['F', 'freeze the culling and go on, or resume'],
  ['G', 'graph'],
  ['H', 'these keys'],
  ['Two thumbs', 'left: walk; right: look around'],
];

/** Lists the keys. */
export function listKeys(): void {
  const rows = KEYS.map(([keys, what]) => {
    const row = document.createElement('tr');
    const head = Object.assign(document.createElement('th'), { textContent: keys });
    row.append(head, Object.assign(document.createElement('td'), { textContent: what }));
    return row;
  });
  const table = document.createElement('table');
  table.append(...rows);
  element('keys').replaceChildren(table);
}

let timer = 0;

/** Says something; `seconds`: for how long, none: until something else is said. */
export function say(text: string, isBad = false, seconds?: number): void {
  const message = element('message');
  clearTimeout(timer);
  message.textContent = text;
  message.classList.toggle('bad', isBad);
  message.hidden = text === '';
  if (seconds) timer = window.setTimeout(() => say(''), 1000 * seconds);
}
