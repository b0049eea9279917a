/* The viewer: a row of a table opens its run; another run of the same question may be laid over it. */
(() => {
  const bodies = new Map([...document.querySelectorAll("script.body")].map((item) => [item.dataset.run, {
    key: item.dataset.run, group: item.dataset.group, label: item.dataset.label, solver: item.dataset.solver,
    header: JSON.parse(item.dataset.header), item,
  }]));
  if (!bodies.size) return;
  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const paint = (solver) => [...rgb((style(`--${solver}`) || "#888888").slice(1)), 1];
  let view = null;

  async function body(key) {
    const found = bodies.get(key);
    found.drawn ??= view.gl.upload(await unpacked(found.header, found.item.textContent));
    return found;
  }

  function labelled(text, control) { return make("label", {}, make("span", {}, text), control); }
  function slider(text, min, max, step, value, moved) {
    const input = make("input", { type: "range", min, max, step, value, "aria-label": text, input: moved });
    return input;
  }

  function built() {
    const canvas = make("canvas", { tabindex: "0", "aria-label": "the body; drag to turn, wheel to enlarge, arrow keys turn" });
    const dialog = make("dialog", { class: "viewer", "aria-label": "run in three dimensions" });
    const title = make("h2"), first = make("select"), second = make("select");
    const scale = slider("scale of the displacement", 0, 2, 0.01, 1, redraw);
    const step = slider("step", -1, 0, 0.01, 0, redraw);
    const colour = make("select", { change: redraw });
    const lines = make("input", { type: "checkbox", change: redraw });
    lines.checked = true;
    const said = make("output"), bar = make("div", { class: "scale" }), play = make("button", { type: "button", click: run }, "play");
    first.addEventListener("change", () => open(first.value, second.value));
    second.addEventListener("change", () => open(first.value, second.value));
    const close = make("button", { type: "button", class: "close", click: () => dialog.close(), "aria-label": "close" }, "\u00d7");
    const controls = make("div", { class: "controls" }, labelled("run", first), labelled("laid over it", second),
      labelled("step", step), play, labelled("scale", scale), labelled("colour", colour), labelled("mesh lines", lines));
    dialog.append(close, title, canvas, bar, said, controls);
    document.body.append(dialog);
    const gl = scene3d(canvas);
    if (!gl) said.textContent = "This browser has no WebGL 2; the pictures and numbers of the page do not depend on it.";
    turned(canvas);
    new ResizeObserver(redraw).observe(canvas);
    return { canvas, dialog, title, first, second, scale, step, colour, lines, said, bar, play, gl, shown: [] };
  }

  function turned(canvas) {
    let last = null;
    canvas.addEventListener("pointerdown", (event) => { last = [event.clientX, event.clientY]; canvas.setPointerCapture(event.pointerId); });
    canvas.addEventListener("pointerup", () => { last = null; });
    canvas.addEventListener("pointermove", (event) => {
      if (!last || !view.camera) return;
      turn(event.clientX - last[0], event.clientY - last[1], event.shiftKey);
      last = [event.clientX, event.clientY];
    });
    canvas.addEventListener("wheel", (event) => { event.preventDefault(); view.camera.zoom *= Math.exp(-0.001 * event.deltaY); redraw(); }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const by = { ArrowLeft: [-20, 0], ArrowRight: [20, 0], ArrowUp: [0, -20], ArrowDown: [0, 20] }[event.key];
      const zoom = { "+": 1.2, "-": 1 / 1.2 }[event.key];
      if (by) turn(...by, event.shiftKey);
      if (zoom) { view.camera.zoom *= zoom; redraw(); }
      if (by || zoom) event.preventDefault();
    });
  }

  function turn(x, y, shifts) {
    const camera = view.camera;
    if (shifts) camera.shift = [camera.shift[0] + 2 * x / view.canvas.clientWidth, camera.shift[1] - 2 * y / view.canvas.clientHeight];
    else { camera.turn -= 0.008 * x; camera.rise = Math.max(-1.5, Math.min(1.5, camera.rise + 0.008 * y)); }
    redraw();
  }

  function redraw() {
    if (!view || !view.gl || !view.shown.length) return;
    const step = Number(view.step.value), scale = Number(view.scale.value);
    const fields = view.shown[0].header.fields, field = fields.findIndex(({ name }) => name === view.colour.value);
    const greatest = field >= 0 ? fields[field].greatest : Math.max(...view.shown.map(({ header }) => Math.max(...header.greatest)));
    const coloured = view.colour.value !== "solver", unit = field >= 0 ? fields[field].name : "displacement (m)";
    const drawn = view.shown.map((found, i) => ({
      body: found.drawn, step: i ? matching(view.shown[0], found, step) : step, lines: view.lines.checked,
      coloured: coloured && i === 0, over: i > 0, paint: paint(found.solver),
    })).filter((found) => found.step !== null);
    view.gl.draw(drawn, view.camera, { scale, greatest, field });
    view.bar.replaceChildren();
    if (coloured) view.bar.append(make("span", {}, `${unit}: 0`), make("i"), make("span", {}, shown(greatest, 3)));
    const at = step < 0 ? "between rest and " + view.shown[0].header.steps[0] : view.shown[0].header.steps[Math.round(step)];
    view.said.textContent = `${step <= -1 ? "at rest" : at}; displacements ${shown(scale, 3)} times as large` +
      (drawn.length > 1 ? `; laid over it in its own colour: ${view.shown[1].label}` : "") +
      (drawn.length < view.shown.length ? `; this page holds no such output of ${view.shown[1].label}` : "");
  }

  /** The step of another body that shows the same output as this one's; null where the page does not hold it. */
  function matching(main, other, step) {
    const words = (name) => name.split(",")[0]; // of "mode 1, 12.3 Hz" what both solvers call it
    const names = other.header.steps.map(words), place = (k) => (k < 0 ? -1 : names.indexOf(words(main.header.steps[k])));
    const [low, high] = [Math.floor(step), Math.ceil(step)], [a, b] = [place(low), place(high)];
    if ((low >= 0 && a < 0) || (high >= 0 && b < 0) || b - a > 1) return null;
    return a + (step - low) * (b - a);
  }

  function run() {
    if (view.running) { cancelAnimationFrame(view.running); view.running = null; view.play.textContent = "play"; return; }
    view.play.textContent = "stop";
    const [low, high] = [-1, Number(view.step.max)], start = performance.now(), from = Number(view.step.value);
    const frame = (now) => {
      const span = high - low;
      view.step.value = low + ((from - low + (now - start) * span / 3000) % span);
      redraw();
      view.running = requestAnimationFrame(frame);
    };
    view.running = requestAnimationFrame(frame);
  }

  function choices(select, keys, chosen, none) {
    select.replaceChildren(...(none ? [make("option", { value: "" }, "nothing")] : []),
      ...keys.map((key) => make("option", { value: key }, bodies.get(key).label)));
    select.value = chosen;
  }

  async function open(key, other) {
    view ??= built();
    const main = bodies.get(key), group = [...bodies.values()].filter((found) => found.group === main.group);
    if (other === undefined) other = (group.find((found) => found.solver !== main.solver) || { key: "" }).key;
    if (other === key || (other && bodies.get(other).group !== main.group)) other = "";
    choices(view.first, group.map((found) => found.key), key, false);
    choices(view.second, group.map((found) => found.key).filter((found) => found !== key), other, true);
    view.title.textContent = main.label;
    const kept = view.colour.value, ways = ["size of the displacement", ...main.header.fields.map(({ name }) => name), "solver"];
    view.colour.replaceChildren(...ways.map((value) => make("option", { value }, value)));
    if (ways.includes(kept)) view.colour.value = kept;
    if (!view.dialog.open) view.dialog.showModal();
    if (!view.gl) return;
    const opened = [await body(key), ...(other ? [await body(other)] : [])];
    const last = main.header.steps.length - 1;
    view.step.max = last;
    view.step.value = last;
    if (!view.camera || view.group !== main.group) view.camera = placed(opened[0].drawn);
    view.group = main.group;
    view.shown = opened;
    redraw();
    document.documentElement.dataset.viewed = key;
  }

  function placed(drawn) {
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity], seen = [];
    for (const shape of [null, ...drawn.shapes]) {
      drawn.points.forEach((value, i) => {
        const moved = value + (shape ? shape[i] : 0), k = i % 3;
        low[k] = Math.min(low[k], moved);
        high[k] = Math.max(high[k], moved);
        seen.push(moved);
      });
    }
    const centre = low.map((value, k) => (value + high[k]) / 2);
    const camera = turning(centre, 1), { right, up } = camera.axes(), [wide, tall] = [view.canvas.clientWidth, view.canvas.clientHeight];
    let [across, above] = [0, 0];
    for (let i = 0; i < seen.length; i += 3) {
      const at = [0, 1, 2].map((k) => seen[i + k] - centre[k]), along = (axis) => Math.abs(at[0] * axis[0] + at[1] * axis[1] + at[2] * axis[2]);
      across = Math.max(across, along(right));
      above = Math.max(above, along(up));
    }
    camera.reach = 1.06 * Math.max(across * Math.min(1, tall / wide), above * Math.min(1, wide / tall)) || 1;
    return camera;
  }

  for (const row of document.querySelectorAll("tr[data-run]")) {
    if (!bodies.has(row.dataset.run)) continue;
    row.cells[0].append(" ", make("button", {
      type: "button", class: "open3d", "aria-label": `open ${bodies.get(row.dataset.run).label} in three dimensions`,
      click: () => open(row.dataset.run),
    }, "3-D"));
  }
  const asked = decodeURIComponent(location.hash).match(/^#3d=(.+)$/);
  if (asked && bodies.has(asked[1])) open(asked[1]);
})();
