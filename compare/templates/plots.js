/* Plots: values under the pointer, series switched off and on, a dragged rectangle enlarged. */
(() => {
  const place = (svg, event) => {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    return [at.x, at.y];
  };

  function nearest(series, [x, y], reach) {
    let found = null, least = reach * reach;
    for (const line of series) {
      if (line.off) continue;
      line.at.forEach(([px, py], i) => {
        const square = (px - x) ** 2 + (py - y) ** 2;
        if (square < least) { least = square; found = { line, i }; }
      });
    }
    return found;
  }

  function tell(tip, dot, found) {
    tip.hidden = !found;
    dot.setAttribute("visibility", found ? "visible" : "hidden");
    if (!found) return;
    const { line, i } = found, [x, y] = line.at[i];
    dot.setAttribute("cx", x);
    dot.setAttribute("cy", y);
    tip.textContent = `${line.label}: ${line.xlabel} ${shown(line.x[i])}, ${line.ylabel} ${shown(line.y[i])}`;
  }

  function switches(svg, figure, series) {
    if (series.length < 2) return;
    const row = make("div", { class: "switches", role: "group", "aria-label": "series shown" });
    for (const line of series) {
      const button = make("button", { type: "button", "aria-pressed": "true", click: () => {
        line.off = !line.off;
        button.setAttribute("aria-pressed", String(!line.off));
        svg.querySelectorAll(`[data-series="${line.id}"]`).forEach((part) => { part.style.display = line.off ? "none" : ""; });
      } }, make("i", { style: `background:${line.colour}` }), line.label);
      row.append(button);
    }
    figure.querySelector("figcaption").before(row);
  }

  /** Values from low to high at round steps (of the logarithm where a decade is seen), each with its label. */
  function ticks(low, high, log) {
    const [a, b] = [Math.min(low, high), Math.max(low, high)], found = [];
    if (log && b > 9 * a) {
      const each = Math.ceil(Math.log10(b / a) / 8), subs = b < 1e3 * a ? [1, 2, 5] : [1];
      for (let k = Math.floor(Math.log10(a)); k <= Math.log10(b); k += each)
        for (const sub of subs) found.push(sub * 10 ** k);
      return found.filter((value) => value >= a && value <= b).map((value) => [value, shown(value, 3)]);
    }
    const rough = (b - a) / 5, power = 10 ** Math.floor(Math.log10(rough));
    const step = power * [1, 2, 5, 10].find((k) => k * power >= rough), digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    for (let k = Math.ceil(a / step); k * step <= b; k++) found.push([k * step, (k * step).toFixed(Math.min(digits, 12)).replace("-", "\u2212")]);
    return found;
  }

  /** A panel of a plot that can be seen in part: what it draws is moved, its ticks are drawn anew. */
  function panel(svg, about, group) {
    const [left, top, right, bottom] = about.box, drawn = [];
    for (const part of group.querySelectorAll("[clip-path] use, [clip-path]")) {
      if (part.closest("[data-tick]")) continue;
      if (part.tagName === "use") drawn.push({ part, x: Number(part.getAttribute("x")), y: Number(part.getAttribute("y")) });
      else if (part.hasAttribute("d")) drawn.push({ part, d: part.getAttribute("d") });
    }
    const whole = { left, top, right, bottom };
    const limits = (name, low, high) => {
      const read = about["log" + name] ? Math.log10 : (value) => value, write = about["log" + name] ? (value) => 10 ** value : (value) => value;
      const [a, b] = about[name].map(read), [from, to] = name === "x" ? [left, right] : [bottom, top];
      return [low, high].map((at) => write(a + (b - a) * (at - from) / (to - from)));
    };
    const moved = (seen) => [(x) => left + (x - seen.left) / (seen.right - seen.left) * (right - left),
      (y) => top + (y - seen.top) / (seen.bottom - seen.top) * (bottom - top)];

    function redrawn(name, seen) {
      const old = [...group.querySelectorAll(`[data-tick="${name}"]`)].filter((tick) => tick.closest("[data-panel]") === group);
      const fresh = old.filter((tick) => tick.dataset.fresh), first = old.find((tick) => !tick.dataset.fresh);
      fresh.forEach((tick) => tick.remove());
      if (!first) return;
      const isWhole = seen === whole, axis = first.parentNode;
      old.filter((tick) => !tick.dataset.fresh).forEach((tick) => { tick.style.display = isWhole ? "" : "none"; });
      for (const words of axis.children) // an exponent or offset beside the axis belongs to the old ticks
        if (!words.dataset.tick && !about.labels.includes(words.textContent.trim())) words.style.display = isWhole ? "" : "none";
      if (isWhole) return;
      const at = (mark) => Number(mark.getAttribute(name)), place = at(first.querySelector("use"));
      const [low, high] = name === "x" ? limits("x", seen.left, seen.right) : limits("y", seen.bottom, seen.top);
      const to = moved(seen)[name === "x" ? 0 : 1], [a, b] = about[name], log = about["log" + name];
      const part = (value) => (log ? Math.log(value / a) / Math.log(b / a) : (value - a) / (b - a));
      for (const [value, label] of ticks(low, high, log)) {
        const tick = first.cloneNode(true), x = to(name === "x" ? left + part(value) * (right - left) : bottom + part(value) * (top - bottom));
        tick.style.display = "";
        tick.dataset.fresh = "yes";
        tick.setAttribute("transform", name === "x" ? `translate(${x - place} 0)` : `translate(0 ${x - place})`);
        const text = tick.querySelector("text");
        if (text) text.textContent = label;
        axis.append(tick);
      }
    }

    function see(seen) {
      const [x, y] = moved(seen);
      for (const { part, d, x: px, y: py } of drawn) {
        if (d === undefined) { part.setAttribute("x", x(px)); part.setAttribute("y", y(py)); continue; }
        let axis = 0;
        part.setAttribute("d", d.replace(/-?\d+(\.\d+)?(e-?\d+)?/g, (n) => (axis++ % 2 ? y(Number(n)) : x(Number(n))).toFixed(3)));
      }
      redrawn("x", seen);
      redrawn("y", seen);
      return ([px, py]) => [x(px), y(py)];
    }
    const within = (x, y) => x >= left - 1 && x <= right + 1 && y >= top - 1 && y <= bottom + 1;
    return { see, whole, within, about };
  }

  function zoom(svg, figure, series) {
    const groups = [...svg.querySelectorAll("[data-panel]")];
    const panels = JSON.parse(svg.dataset.panels).map((about, i) => panel(svg, about, groups[i]));
    const frame = document.createElementNS(svg.namespaceURI, "rect");
    frame.setAttribute("class", "zoom");
    series.forEach((line) => { line.all = line.at; });
    const beside = (one, other) => ["x", "logx"].every((key) => String(one.about[key]) === String(other.about[key])) &&
      one.about.box[0] === other.about.box[0] && one.about.box[2] === other.about.box[2];
    panels.forEach((one) => { one.now = one.whole; });
    const see = (k, seen) => {
      panels[k].now = seen;
      const place = panels[k].see(seen);
      for (const line of series.filter((item) => item.panel === k))
        line.at = line.all.map(place).map((at) => (panels[k].within(...at) ? at : [NaN, NaN]));
    };
    const back = make("button", { type: "button", class: "back", hidden: "", click: () => {
      panels.forEach((one, k) => see(k, one.whole));
      back.hidden = true;
    } }, "whole plot");
    const enlarge = (k, box) => {
      panels.forEach((other, m) => {
        if (m === k) see(m, box);
        else if (beside(panels[k], other)) see(m, { ...other.now, left: box.left, right: box.right });
      });
      back.hidden = false;
    };
    figure.querySelector("figcaption").before(back);
    let start = null;
    svg.addEventListener("pointerdown", (event) => { if (event.pointerType === "mouse" && event.button === 0) start = place(svg, event); });
    svg.addEventListener("pointermove", (event) => {
      if (!start) return;
      const [x, y] = place(svg, event), box = [Math.min(x, start[0]), Math.min(y, start[1]), Math.abs(x - start[0]), Math.abs(y - start[1])];
      ["x", "y", "width", "height"].forEach((name, i) => frame.setAttribute(name, box[i]));
      svg.append(frame);
    });
    const end = (event) => {
      if (!start) return;
      const [x, y] = place(svg, event), k = panels.findIndex((one) => one.within(...start));
      frame.remove();
      if (k >= 0 && Math.abs(x - start[0]) > 8 && Math.abs(y - start[1]) > 8) {
        const [left, top, right, bottom] = panels[k].about.box, kept = (n, low, high) => Math.min(Math.max(n, low), high);
        const now = panels[k].now, across = (n) => now.left + (n - left) / (right - left) * (now.right - now.left);
        const along = (n) => now.top + (n - top) / (bottom - top) * (now.bottom - now.top);
        const [x0, x1] = [x, start[0]].map((n) => across(kept(n, left, right))).sort((a, b) => a - b);
        const [y0, y1] = [y, start[1]].map((n) => along(kept(n, top, bottom))).sort((a, b) => a - b);
        enlarge(k, { left: x0, right: x1, top: y0, bottom: y1 });
      }
      start = null;
    };
    svg.addEventListener("pointerup", end);
    svg.addEventListener("pointerleave", () => { start = null; frame.remove(); });
    svg.addEventListener("dblclick", () => back.click());
  }

  for (const svg of document.querySelectorAll("svg[data-points]")) {
    const figure = svg.closest("figure"), series = JSON.parse(svg.dataset.points);
    const tip = make("output", { class: "tip", hidden: "" });
    const dot = document.createElementNS(svg.namespaceURI, "circle");
    dot.setAttribute("r", "5");
    dot.setAttribute("class", "dot");
    dot.setAttribute("visibility", "hidden");
    svg.append(dot);
    figure.append(tip);
    svg.addEventListener("pointermove", (event) => tell(tip, dot, nearest(series, place(svg, event), 24)));
    svg.addEventListener("pointerdown", (event) => tell(tip, dot, nearest(series, place(svg, event), 24)));
    svg.addEventListener("pointerleave", () => tell(tip, dot, null));
    switches(svg, figure, series);
    zoom(svg, figure, series);
  }
})();
