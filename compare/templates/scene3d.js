/* Drawing bodies with WebGL 2: triangles shaded by their own slope, mesh lines, colours of cividis. */

/** The arrays of compare.bodies.pack from the base64 text of a body. */
async function unpacked(header, text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const raw = await new Response(stream).arrayBuffer();
  const n = header.points, fields = 1 + header.steps.length, Index = header.wide ? Uint32Array : Uint16Array;
  const size = 2 * n * (3 * fields + header.fields.length);
  const numbers = new Int16Array(raw.slice(0, size)), rest = new Index(raw.slice(size));
  const interleaved = (array, rows, count, Type) => {
    const found = new Type(rows * count), sum = new array.constructor(1);
    for (let row = 0; row < rows; row++) {
      sum[0] = 0;
      for (let i = 0; i < count; i++) { sum[0] += array[row * count + i]; found[i * rows + row] = sum[0]; }
    }
    return found;
  };
  const field = (k, unit, origin) => interleaved(numbers.subarray(3 * n * k, 3 * n * (k + 1)), 3, n, Float32Array)
    .map((value, i) => origin[i % 3] + unit * value);
  const triangles = 3 * header.triangles;
  return {
    points: field(0, header.unit, header.origin),
    shapes: header.steps.map((_, k) => field(k + 1, header.moved, [0, 0, 0])),
    fields: header.fields.map(({ unit }, k) => interleaved(numbers.subarray(n * (3 * fields + k), n * (3 * fields + k + 1)), 1, n, Float32Array)
      .map((value) => unit * value)),
    triangles: interleaved(rest.subarray(0, triangles), 3, header.triangles, Uint32Array),
    edges: interleaved(rest.subarray(triangles), 2, header.edges, Uint32Array),
  };
}

const VERTEX = `#version 300 es
in vec3 point; in vec3 from; in vec3 to; in float scalar;
uniform mat4 view; uniform float scale, part, greatest, lift; uniform int byField;
out vec3 place; out float value;
void main() {
  vec3 moved = mix(from, to, part);
  place = point + scale * moved;
  value = greatest > 0.0 ? (byField == 1 ? scalar : length(moved)) / greatest : 0.0;
  gl_Position = view * vec4(place, 1.0);
  gl_Position.z -= lift * gl_Position.w;
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 place; in float value;
uniform vec4 paint; uniform int coloured, flatly; uniform vec3 light;
uniform vec3 scaleColours[10];
out vec4 colour;
void main() {
  vec3 base = paint.rgb;
  if (coloured == 1) {
    float at = clamp(value, 0.0, 1.0) * 9.0;
    int i = int(min(floor(at), 8.0));
    base = mix(scaleColours[i], scaleColours[i + 1], at - float(i));
  }
  if (flatly == 0) {
    vec3 normal = normalize(cross(dFdx(place), dFdy(place)));
    base *= 0.55 + 0.45 * abs(dot(normal, light));
  }
  colour = vec4(base * paint.a, paint.a);
}`;
const CIVIDIS = ["00224e", "123570", "3b496c", "575d6d", "707173", "8a8678", "a59c74", "c3b369", "e1cc55", "fee838"];
const rgb = (hex) => [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);

/** A drawing surface on a canvas; null where the browser has no WebGL 2. */
function scene3d(canvas) {
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, preserveDrawingBuffer: true });
  if (!gl) return null;
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  gl.useProgram(program);
  const uniform = (name) => gl.getUniformLocation(program, name);
  gl.uniform3fv(uniform("scaleColours"), CIVIDIS.flatMap(rgb));

  const filled = (kind, data) => {
    const buffer = gl.createBuffer();
    gl.bindBuffer(kind, buffer);
    gl.bufferData(kind, data, gl.STATIC_DRAW);
    return buffer;
  };
  const upload = (body) => ({
    ...body,
    buffers: {
      points: filled(gl.ARRAY_BUFFER, body.points),
      shapes: body.shapes.map((shape) => filled(gl.ARRAY_BUFFER, shape)),
      zero: filled(gl.ARRAY_BUFFER, new Float32Array(body.points.length)),
      fields: body.fields.map((values) => filled(gl.ARRAY_BUFFER, values)),
      triangles: filled(gl.ELEMENT_ARRAY_BUFFER, body.triangles),
      edges: filled(gl.ELEMENT_ARRAY_BUFFER, body.edges),
    },
  });
  const bind = (name, buffer, size = 3) => {
    const at = gl.getAttribLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, gl.FLOAT, false, 0, 0);
  };

  function draw(bodies, camera, look) {
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const [w, h] = [Math.max(1, Math.round(canvas.clientWidth * ratio)), Math.max(1, Math.round(canvas.clientHeight * ratio))];
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    gl.viewport(0, 0, w, h);
    gl.depthMask(true);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.uniformMatrix4fv(uniform("view"), false, camera.matrix(w / h));
    gl.uniform3fv(uniform("light"), camera.forward());
    gl.uniform1f(uniform("scale"), look.scale);
    gl.uniform1f(uniform("greatest"), look.greatest);
    for (const { body, paint, coloured, step, lines, over } of bodies) {
      const low = Math.floor(step), high = Math.min(low + 1, body.shapes.length - 1), shapes = body.buffers.shapes;
      bind("point", body.buffers.points);
      bind("from", low < 0 ? body.buffers.zero : shapes[low]);
      bind("to", high < 0 ? body.buffers.zero : shapes[high]);
      bind("scalar", look.field >= 0 ? body.buffers.fields[look.field] || body.buffers.zero : body.buffers.zero, 1);
      gl.uniform1i(uniform("byField"), look.field >= 0 ? 1 : 0);
      gl.uniform1f(uniform("part"), step - low);
      gl.uniform1i(uniform("coloured"), coloured ? 1 : 0);
      gl.uniform1i(uniform("flatly"), 0);
      gl.uniform1f(uniform("lift"), 0);
      gl.uniform4fv(uniform("paint"), [...paint.slice(0, 3), over ? 0.35 : 1]);
      gl.depthMask(!over);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, body.buffers.triangles);
      gl.drawElements(gl.TRIANGLES, body.triangles.length, gl.UNSIGNED_INT, 0);
      if (!lines) continue;
      gl.uniform1i(uniform("coloured"), 0);
      gl.uniform1i(uniform("flatly"), 1);
      gl.uniform1f(uniform("lift"), 2e-4);
      gl.uniform4fv(uniform("paint"), over ? paint : [0.1, 0.13, 0.16, 0.75]);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, body.buffers.edges);
      gl.drawElements(gl.LINES, body.edges.length, gl.UNSIGNED_INT, 0);
    }
  }
  return { upload, draw };
}

/** A camera that turns around a centre, without perspective; angles in radians, reach in metres. */
function turning(centre, reach) {
  const camera = { centre, reach, turn: -1.0, rise: 0.5, zoom: 1, shift: [0, 0] };
  const axes = () => {
    const [c, s, cr, sr] = [Math.cos(camera.turn), Math.sin(camera.turn), Math.cos(camera.rise), Math.sin(camera.rise)];
    return { right: [-s, c, 0], up: [-c * sr, -s * sr, cr], back: [c * cr, s * cr, sr] };
  };
  camera.forward = () => axes().back;
  camera.axes = axes;
  camera.matrix = (aspect) => {
    const { right, up, back } = axes(), wide = camera.zoom / camera.reach / Math.max(aspect, 1), high = wide * aspect;
    const dot = (a) => a[0] * centre[0] + a[1] * centre[1] + a[2] * centre[2], deep = -0.1 / camera.reach;
    return new Float32Array([
      wide * right[0], high * up[0], deep * back[0], 0,
      wide * right[1], high * up[1], deep * back[1], 0,
      wide * right[2], high * up[2], deep * back[2], 0,
      -wide * dot(right) + camera.shift[0], -high * dot(up) + camera.shift[1], -deep * dot(back), 1,
    ]);
  };
  return camera;
}
