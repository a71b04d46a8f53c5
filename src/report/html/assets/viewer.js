// Turns the meshes that stand in the page: parallel projection, flat shading, back faces red.
"use strict";
(() => {
  const viewer = document.getElementById("viewer");
  const data = document.getElementById("meshes");
  if (!viewer || !data) return;
  document.documentElement.classList.add("scripted");
  const canvas = viewer.querySelector("canvas");
  const told = viewer.querySelector("output");
  const gl = canvas.getContext("webgl", { antialias: true });
  if (!gl) {
    told.textContent = "This browser shows no WebGL.";
    return;
  }
  const START = { yaw: Math.PI / 4, pitch: Math.asin(1 / Math.sqrt(3)), zoom: 1 };
  const view = { ...START };

  const bytesOf = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const numbers = (text) => {
    const bytes = bytesOf(text);
    const words = new DataView(bytes.buffer);
    const out = new Uint16Array(bytes.length / 2);
    for (let i = 0; i < out.length; i++) out[i] = words.getUint16(2 * i, true);
    return out;
  };

  // A colour of the scale, of a share of 255.
  const tint = (share, ramp) => {
    const place = (share / 255) * (ramp.length - 1);
    const below = Math.min(Math.floor(place), ramp.length - 2);
    const part = place - below;
    return ramp[below].map((low, i) => (low + (ramp[below + 1][i] - low) * part) / 255);
  };

  // Corners about the middle of the cube, each with the normal of its triangle and the colour of its
  // deviation.
  const PARTS = 9;
  const unroll = ({ vertices, triangles }, shares, ramp) => {
    const places = numbers(vertices);
    const corners = numbers(triangles);
    const out = new Float32Array(PARTS * corners.length);
    const at = (corner, axis) => places[3 * corner + axis] / 32767.5 - 1;
    for (let first = 0; first < corners.length; first += 3) {
      const [a, b, c] = [0, 1, 2].map((k) => [0, 1, 2].map((axis) => at(corners[first + k], axis)));
      const [u, v] = [b, c].map((p) => p.map((value, axis) => value - a[axis]));
      const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      const length = Math.hypot(...normal) || 1;
      [a, b, c].forEach((place, k) => {
        out.set(place, PARTS * (first + k));
        out.set(normal.map((value) => value / length), PARTS * (first + k) + 3);
        if (shares) out.set(tint(shares[corners[first + k]], ramp), PARTS * (first + k) + 6);
      });
    }
    return out;
  };

  const compile = (kind, text) => {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    return shader;
  };
  const program = gl.createProgram();
  gl.attachShader(program, compile(gl.VERTEX_SHADER, `
    attribute vec3 place, normal, deviation;
    uniform mat3 turn;
    uniform float scale;
    varying vec3 seen, tint;
    void main() {
      vec3 at = turn * place;
      tint = deviation;
      seen = turn * normal;
      gl_Position = vec4(at.xy * scale, -at.z * 0.5, 1.0);
    }`));
  gl.attachShader(program, compile(gl.FRAGMENT_SHADER, `
    precision mediump float;
    uniform vec3 colour, back;
    uniform bool mapped;
    varying vec3 seen, tint;
    void main() {
      vec3 n = normalize(gl_FrontFacing ? seen : -seen);
      vec3 base = gl_FrontFacing ? colour : back;
      float light = 0.10 + 0.75 * max(dot(n, vec3(-0.45, 0.75, 0.49)), 0.0)
        + 0.28 * max(dot(n, vec3(0.70, -0.10, 0.71)), 0.0);
      vec3 lit = pow(base * min(light, 1.0), vec3(1.0 / 2.2));
      gl_FragColor = vec4(mapped ? tint * (0.5 + 0.5 * min(light, 1.0)) : lit, 1.0);
    }`));
  gl.linkProgram(program);
  gl.useProgram(program);
  const uniform = (name) => gl.getUniformLocation(program, name);
  const [turn, scale, colour, back, mapped] =
    ["turn", "scale", "colour", "back", "mapped"].map(uniform);

  const meshes = JSON.parse(data.textContent);
  const sides = {};
  for (const name of ["before", "after"]) {
    const shares = name === "after" && meshes.deviation ? bytesOf(meshes.deviation) : null;
    const corners = unroll(meshes[name], shares, meshes.ramp);
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    sides[name] = { buffer, all: corners, corners: corners.length / PARTS };
  }
  // The result once more, in other colours.
  if (meshes.deviation) sides.deviation = sides.after;
  let side = "after";
  // Whatever way it is turned, all of the result is seen.
  let radius = 0;
  for (let i = 0; i < sides.after.all.length; i += PARTS) {
    radius = Math.max(radius, Math.hypot(...sides.after.all.subarray(i, i + 3)));
  }
  radius = radius || 1;

  const draw = () => {
    const pixels = Math.max(1, Math.round(canvas.clientWidth * (window.devicePixelRatio || 1)));
    if (canvas.width !== pixels) canvas.width = canvas.height = pixels;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0.951, 0.956, 0.966, 1);
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const [cy, sy] = [Math.cos(view.yaw), Math.sin(view.yaw)];
    const [cp, sp] = [Math.cos(view.pitch), Math.sin(view.pitch)];
    // Columns: where x, y and z of the model go.
    gl.uniformMatrix3fv(turn, false, [cy, -sp * sy, cp * sy, 0, cp, sp, -sy, -sp * cy, cp * cy]);
    gl.uniform1f(scale, (0.96 * view.zoom) / radius);
    const front = side === "before" ? [0.58, 0.64, 0.72] : [0.66, 0.66, 0.66];
    gl.uniform3fv(colour, front);
    // A mesh that was made lighter has faces turned over that the model has not.
    const mesh = meshes[side === "before" ? "before" : "after"];
    gl.uniform3fv(back, mesh.whole ? [0.85, 0.20, 0.16] : front);
    gl.uniform1i(mapped, side === "deviation" ? 1 : 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, sides[side].buffer);
    for (const [name, offset] of [["place", 0], ["normal", 12], ["deviation", 24]]) {
      const slot = gl.getAttribLocation(program, name);
      gl.enableVertexAttribArray(slot);
      gl.vertexAttribPointer(slot, 3, gl.FLOAT, false, 4 * PARTS, offset);
    }
    gl.drawArrays(gl.TRIANGLES, 0, sides[side].corners);
    told.textContent = side;
    viewer.classList.toggle("mapped", side === "deviation");
    for (const button of viewer.querySelectorAll("[data-side]")) {
      button.setAttribute("aria-pressed", String(button.dataset.side === side));
    }
    canvas.dataset.view = [view.yaw, view.pitch, view.zoom].map((v) => v.toFixed(3)).join(" ");
  };
  let waits = false;
  const redraw = () => {
    if (waits) return;
    waits = true;
    requestAnimationFrame(() => {
      waits = false;
      draw();
    });
  };
  const rotate = (dx, dy) => {
    view.yaw -= dx;
    view.pitch = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, view.pitch + dy));
    redraw();
  };
  const zoom = (factor) => {
    view.zoom = Math.min(20, Math.max(0.3, view.zoom * factor));
    redraw();
  };

  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    if (canvas.hasPointerCapture(event.pointerId)) {
      rotate(0.01 * event.movementX, 0.01 * event.movementY);
    }
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(-0.0015 * event.deltaY));
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const steps = {
      ArrowLeft: () => rotate(-0.1, 0), ArrowRight: () => rotate(0.1, 0),
      ArrowUp: () => rotate(0, -0.1), ArrowDown: () => rotate(0, 0.1),
      "+": () => zoom(1.2), "-": () => zoom(1 / 1.2),
    };
    if (steps[event.key]) {
      event.preventDefault();
      steps[event.key]();
    }
  });
  for (const button of viewer.querySelectorAll("[data-side]")) {
    button.addEventListener("click", () => {
      side = button.dataset.side;
      redraw();
    });
  }
  viewer.querySelector("[data-reset]").addEventListener("click", () => {
    Object.assign(view, START);
    redraw();
  });
  new ResizeObserver(redraw).observe(canvas);
  draw();
})();
