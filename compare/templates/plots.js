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

  function zoom(svg, figure) {
    const whole = svg.getAttribute("viewBox"), frame = document.createElementNS(svg.namespaceURI, "rect");
    frame.setAttribute("class", "zoom");
    const back = make("button", { type: "button", class: "back", hidden: "", click: () => {
      svg.setAttribute("viewBox", whole);
      back.hidden = true;
    } }, "whole plot");
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
      const [x, y] = place(svg, event), [w, h] = [Math.abs(x - start[0]), Math.abs(y - start[1])];
      frame.remove();
      if (w > 8 && h > 8) {
        svg.setAttribute("viewBox", [Math.min(x, start[0]), Math.min(y, start[1]), w, h].map((n) => n.toFixed(1)).join(" "));
        back.hidden = false;
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
    zoom(svg, figure);
  }
})();
