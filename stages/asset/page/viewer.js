// The asset in WebGL 2 by the BRDF that it was made with: glTF's GGX, height-correlated Smith, Schlick. The light is preview.png's:
// its sun a lamp with a shadow map, the rest nine harmonics for the diffuse part and mip levels blurred by GGX for the glossy one.
// World: z up, as in the pipeline.
"use strict";

const VERTEX = `#version 300 es
layout(location = 0) in vec3 position;  // 0 to 1 in the box
layout(location = 1) in vec2 octahedral;
layout(location = 2) in vec2 texcoord;
uniform mat4 projection;
uniform vec3 origin, uvBox;             // of UVs: least u and v, extent
uniform float extent;
out vec3 p;
out vec3 normal;
out vec2 uv;
void main() {
  p = origin + extent * position;
  vec3 n = vec3(octahedral, 1.0 - abs(octahedral.x) - abs(octahedral.y));
  if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
  normal = n;
  uv = uvBox.xy + uvBox.z * texcoord;
  gl_Position = projection * vec4(p, 1.0);
}`;

const NOTHING = `#version 300 es
void main() {}`;

const FRAGMENT = `#version 300 es
precision highp float;
precision highp sampler2DShadow;
in vec3 p;
in vec3 normal;
in vec2 uv;
uniform int shown;
uniform vec3 eye, sun, power;
uniform vec2 turn;                      // cosine and sine of the light's angle
uniform float spread, exposure, levels, leastCosine, density, normalScale;
uniform bool hasNormal;
uniform vec3 harmonics[9];
uniform mat4 toShadow;
uniform sampler2D albedoMap, roughnessMap, metallicMap, occlusionMap, normalMap, environment, albedos;
uniform sampler2DShadow shadow;
out vec4 color;

const float PI = 3.14159265;

vec3 encode(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}

vec3 unturned(vec3 w) { return vec3(turn.x * w.x + turn.y * w.y, turn.x * w.y - turn.y * w.x, w.z); }

vec3 irradianceOverPi(vec3 n) {
  n = unturned(n);
  return max(vec3(0.0), harmonics[0] + harmonics[1] * n.y + harmonics[2] * n.z + harmonics[3] * n.x + harmonics[4] * n.x * n.y
    + harmonics[5] * n.y * n.z + harmonics[6] * (3.0 * n.z * n.z - 1.0) + harmonics[7] * n.x * n.z
    + harmonics[8] * (n.x * n.x - n.y * n.y));
}

vec3 blurredLight(vec3 w, float roughness) {
  w = unturned(w);
  vec2 at = vec2(0.5 - atan(w.y, w.x) / (2.0 * PI), acos(clamp(w.z, -1.0, 1.0)) / PI);
  return textureLod(environment, at, roughness * (levels - 1.0)).rgb;
}

float lit(vec3 ng) {
  vec4 at = toShadow * vec4(p + 0.004 * ng, 1.0);
  vec2 texel = 1.6 / vec2(textureSize(shadow, 0));
  float sum = 0.0;
  for (int y = -3; y <= 3; y++)
    for (int x = -3; x <= 3; x++) sum += texture(shadow, vec3(at.xy + vec2(x, y) * texel, at.z));
  return sum / 49.0;
}

float lambda(float z, float a2) { return 0.5 * (sqrt(1.0 + a2 * (1.0 - z * z) / (z * z)) - 1.0); }

vec3 mapped(vec3 n, vec3 along, vec3 across) {
  vec3 t = texture(normalMap, uv).xyz * 2.0 - 1.0;
  t.xy *= normalScale;
  vec2 du = dFdx(uv), dv = dFdy(uv);    // tangents from how position and UV change over the picture (Schüler 2013)
  vec3 b1 = cross(across, n), b2 = cross(n, along);
  vec3 tangent = b1 * du.x + b2 * dv.x, up = -(b1 * du.y + b2 * dv.y);
  float longest = inversesqrt(max(max(dot(tangent, tangent), dot(up, up)), 1e-30));
  return normalize(t.x * tangent * longest + t.y * up * longest + t.z * n);
}

void main() {
  vec3 v = normalize(eye - p), along = dFdx(p), across = dFdy(p);
  vec3 ng = normalize(cross(along, across));
  if (dot(ng, v) < 0.0) ng = -ng;
  vec3 n = normalize(normal);
  if (dot(n, ng) < 0.0) n = -n;
  if (hasNormal) n = mapped(n, along, across);
  float nv = dot(n, v);
  if (nv < leastCosine) {               // turned away from the viewer: bent back
    vec3 side = normalize(n - nv * v);
    n = leastCosine * v + sqrt(1.0 - leastCosine * leastCosine) * side;
    nv = leastCosine;
  }
  vec3 c = texture(albedoMap, uv).rgb;
  float r = texture(roughnessMap, uv).r, m = texture(metallicMap, uv).r, open = texture(occlusionMap, uv).r;
  if (shown == 1) { color = vec4(encode(c), 1.0); return; }
  if (shown == 2) { color = vec4(vec3(r), 1.0); return; }
  if (shown == 3) { color = vec4(vec3(m), 1.0); return; }
  if (shown == 4) { color = vec4(0.5 + 0.5 * n, 1.0); return; }
  if (shown == 5) { color = vec4(vec3(open), 1.0); return; }
  if (shown == 6) {
    vec2 cell = floor(uv * density);
    float odd = mod(cell.x + cell.y, 2.0);
    color = vec4(mix(vec3(0.22), mix(vec3(0.85), vec3(0.80, 0.52, 0.34), mod(floor(cell.x / 4.0) + floor(cell.y / 4.0), 2.0)), odd)
      * (0.55 + 0.45 * nv), 1.0);
    return;
  }
  vec3 f0 = 0.04 * (1.0 - m) + m * c, white = texture(albedos, vec2(sqrt(nv), r) * (vec2(63.0, 32.0) / vec2(64.0, 33.0)) + 0.5 / vec2(64.0, 33.0)).rgb;
  vec3 mirror = normalize(mix(reflect(-v, n), n, r * r));
  float openLobe = clamp(pow(nv + open, exp2(-16.0 * r - 1.0)) - 1.0 + open, 0.0, 1.0);  // Lagarde & de Rousiers 2014
  vec3 radiance = open * (1.0 - m) * c * irradianceOverPi(n) * white.b
    + openLobe * (f0 * white.r + white.g) * blurredLight(mirror, r);
  float nl = dot(n, sun);
  if (nl > 0.0 && dot(ng, sun) > 0.0) {
    vec3 h = normalize(v + sun);
    float nh = dot(n, h), a2 = r * r * r * r + 0.25 * spread * spread, s = pow(1.0 - dot(v, h), 5.0);
    vec3 across2 = h - nh * n;
    float q = dot(across2, across2) + a2 * nh * nh, d = a2 / (PI * q * q);
    float dg = d / (1.0 + lambda(nv, a2) + lambda(nl, a2)) / (4.0 * nv);
    vec3 reflected = (1.0 - m) * c * (1.0 - 0.04 - 0.96 * s) * nl / PI + (f0 * (1.0 - s) + s) * dg;
    radiance += reflected * power * lit(ng);
  }
  color = vec4(encode(exposure * radiance), 1.0);
}`;

const BACKDROP = `#version 300 es
void main() { gl_Position = vec4(vec2[3](vec2(-1, -1), vec2(3, -1), vec2(-1, 3))[gl_VertexID], 0.9999, 1.0); }`;

const GRADIENT = `#version 300 es
precision highp float;
uniform float height;
uniform vec2 greys;                     // linear, at the bottom and at the top
out vec4 color;
void main() {
  float c = mix(greys.x, greys.y, gl_FragCoord.y / height);
  color = vec4(vec3(1.055 * pow(c, 1.0 / 2.4) - 0.055), 1.0);
}`;

const SHADOW_SIZE = 2048, UNITS = ["albedo", "roughness", "metallic", "occlusion", "normal"];

// ---------------------------------------------------------------------------------------------- data of the page

const data = JSON.parse(document.getElementById("data").textContent);

async function arrays() {
  const text = atob(document.getElementById("blob").textContent);
  const packed = Uint8Array.from(text, (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const found = {};
  let at = 0;
  for (const { name, size, columns, count, delta } of data.streams) {
    const Kind = size === 2 ? Uint16Array : Uint32Array, values = new Kind(columns * count);
    for (let c = 0; c < columns; c++, at += size * count)
      for (let i = 0, value = 0; i < count; i++) {
        let stored = 0;                 // the low bytes of all values come first, then the next
        for (let b = 0; b < size; b++) stored |= bytes[at + b * count + i] << (8 * b);
        value = delta ? value + stored : stored;
        values[i * columns + c] = value;
      }
    found[name] = values;
  }
  return found;
}

// ---------------------------------------------------------------------------------------------- small mathematics

const add = (a, b, t = 1) => a.map((x, i) => x + t * b[i]);
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((x) => x / Math.hypot(...a));

function times(a, b) {                  // 4 x 4, column by column
  const c = new Float32Array(16);
  for (let i = 0; i < 4; i++) for (let j = 0; j < 4; j++) for (let k = 0; k < 4; k++) c[4 * j + i] += a[4 * k + i] * b[4 * j + k];
  return c;
}

function lookAt(eye, target) {
  const z = unit(add(eye, target, -1)), up = Math.abs(z[2]) > 0.999 ? [1, 0, 0] : [0, 0, 1], x = unit(cross(up, z)), y = cross(z, x);
  return new Float32Array([x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -dot(x, eye), -dot(y, eye), -dot(z, eye), 1]);
}

function perspective(fovY, aspect, near, far) {
  const f = 1 / Math.tan(fovY / 2);
  return new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (near + far) / (near - far), -1, 0, 0, (2 * near * far) / (near - far), 0]);
}

const orthographic = (r, depth) => new Float32Array([1 / r, 0, 0, 0, 0, 1 / r, 0, 0, 0, 0, -2 / depth, 0, 0, 0, -1, 1]);

// ---------------------------------------------------------------------------------------------- WebGL

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  const at = {};
  for (let i = 0; i < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); i++) {
    const name = gl.getActiveUniform(made, i).name.replace("[0]", "");
    at[name] = gl.getUniformLocation(made, name);
  }
  return { made, at };
}

function picture(gl, image, srgb, anisotropy) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
  if (image) gl.texImage2D(gl.TEXTURE_2D, 0, srgb ? gl.SRGB8_ALPHA8 : gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, image);
  else gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array([255, 255, 255, 255]));
  gl.generateMipmap(gl.TEXTURE_2D);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
  for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, data.mesh.repeats ? gl.REPEAT : gl.CLAMP_TO_EDGE);
  if (anisotropy) gl.texParameterf(gl.TEXTURE_2D, anisotropy.TEXTURE_MAX_ANISOTROPY_EXT, 8);
  return texture;
}

function environment(gl, texels) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  let at = 0;
  for (let level = 0, height = data.light.height; level < data.light.levels; level++, height >>= 1) {
    gl.texImage2D(gl.TEXTURE_2D, level, gl.RGB9_E5, 2 * height, height, 0, gl.RGB, gl.UNSIGNED_INT_5_9_9_9_REV, texels.subarray(at, at + 2 * height * height));
    at += 2 * height * height;
  }
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAX_LEVEL, data.light.levels - 1);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  return texture;
}

function table(gl, texels) {            // white albedos of A, B and E over N·V (64) and roughness (33)
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA16F, 64, 33, 0, gl.RGBA, gl.HALF_FLOAT, texels);
  for (const [key, value] of [["MIN_FILTER", "LINEAR"], ["MAG_FILTER", "LINEAR"], ["WRAP_S", "CLAMP_TO_EDGE"], ["WRAP_T", "CLAMP_TO_EDGE"]])
    gl.texParameteri(gl.TEXTURE_2D, gl["TEXTURE_" + key], gl[value]);
  return texture;
}

function mesh(gl, given) {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  for (const [place, name, width, kind] of [[0, "position", 3, gl.UNSIGNED_SHORT], [1, "normal", 2, gl.SHORT], [2, "uv", 2, gl.UNSIGNED_SHORT]]) {
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, given[name], gl.STATIC_DRAW);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, width, kind, true, 0, 0);
  }
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, given.triangles, gl.STATIC_DRAW);
  gl.bindVertexArray(null);
  return array;
}

function shadowMap(gl) {
  const texture = gl.createTexture(), target = gl.createFramebuffer();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, SHADOW_SIZE, SHADOW_SIZE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
  gl.bindFramebuffer(gl.FRAMEBUFFER, target);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, texture, 0);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  return { texture, target };
}

// ---------------------------------------------------------------------------------------------- the view

async function start() {
  const canvas = document.getElementById("view"), slider = document.getElementById("light");
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) throw new Error("this browser has no WebGL 2");
  const given = await arrays(), images = [...document.querySelectorAll("img[data-map]")];
  await Promise.all(images.map((image) => image.decode()));
  const anisotropy = gl.getExtension("EXT_texture_filter_anisotropic");
  const sets = data.sets.map((_, set) => UNITS.map((name) => picture(gl, images.find((i) => i.dataset.map === name && +i.dataset.set === set), name === "albedo", anisotropy)));
  const light = environment(gl, given.environment), albedos = table(gl, given.albedos), shape = mesh(gl, given), sunMap = shadowMap(gl);
  const shade = program(gl, VERTEX, FRAGMENT), depth = program(gl, VERTEX, NOTHING), behind = program(gl, BACKDROP, GRADIENT);
  const first = { azimuth: data.view.azimuth, elevation: data.view.elevation, zoom: 1, turn: 0, shown: 0 }, state = { ...first };
  const radius = data.mesh.radius;
  let waiting = false;

  function sunNow() {
    const t = (state.turn * Math.PI) / 180, [x, y, z] = data.light.towards;
    return [Math.cos(t) * x - Math.sin(t) * y, Math.sin(t) * x + Math.cos(t) * y, z];
  }

  function place(at) {
    gl.uniform3fv(at.origin, data.mesh.origin);
    gl.uniform1f(at.extent, data.mesh.extent);
    gl.uniform3fv(at.uvBox, data.mesh.uv_box);
  }

  function drawShadow(sun) {
    const clip = times(orthographic(radius * 1.01, 4 * radius), lookAt(sun.map((x) => 2 * radius * x), [0, 0, 0]));
    gl.bindFramebuffer(gl.FRAMEBUFFER, sunMap.target);
    gl.viewport(0, 0, SHADOW_SIZE, SHADOW_SIZE);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.useProgram(depth.made);
    gl.uniformMatrix4fv(depth.at.projection, false, clip);
    place(depth.at);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(2, 4);
    gl.drawElements(gl.TRIANGLES, given.triangles.length, gl.UNSIGNED_INT, 0);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return times(new Float32Array([0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 0.5, 0.5, 0.5, 1]), clip);
  }

  function draw() {
    waiting = false;
    const scale = Math.min(window.devicePixelRatio || 1, 2), width = Math.round(canvas.clientWidth * scale), height = Math.round(canvas.clientHeight * scale);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const a = (state.azimuth * Math.PI) / 180, e = (state.elevation * Math.PI) / 180, aspect = width / height;
    const narrow = Math.min(1, aspect), distance = (state.zoom * data.view.distance) / narrow;
    const eye = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)].map((x) => distance * x), sun = sunNow();
    gl.bindVertexArray(shape);
    gl.enable(gl.DEPTH_TEST);
    const toShadow = drawShadow(sun);
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(behind.made);
    gl.uniform1f(behind.at.height, height);
    gl.uniform2f(behind.at.greys, data.view.ground, data.view.backdrop);
    gl.disable(gl.DEPTH_TEST);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(shade.made);
    const at = shade.at, near = Math.max(distance - 1.2 * radius, 0.02), t = (state.turn * Math.PI) / 180;
    place(at);
    gl.uniformMatrix4fv(at.projection, false, times(perspective(data.view.fov, aspect, near, distance + 1.2 * radius), lookAt(eye, [0, 0, 0])));
    gl.uniformMatrix4fv(at.toShadow, false, toShadow);
    gl.uniform1i(at.shown, state.shown);
    gl.uniform3fv(at.eye, eye);
    gl.uniform3fv(at.sun, sun);
    gl.uniform3fv(at.power, data.light.power);
    gl.uniform2f(at.turn, Math.cos(t), Math.sin(t));
    gl.uniform3fv(at.harmonics, data.light.harmonics);
    for (const [name, value] of [["spread", data.light.spread], ["exposure", data.light.exposure], ["levels", data.light.levels], ["leastCosine", data.light.least_cosine], ["density", data.view.checker]])
      gl.uniform1f(at[name], value);
    ["albedoMap", "roughnessMap", "metallicMap", "occlusionMap", "normalMap", "environment", "albedos", "shadow"].forEach((name, i) => gl.uniform1i(at[name], i));
    [light, albedos, sunMap.texture].forEach((texture, i) => { gl.activeTexture(gl.TEXTURE5 + i); gl.bindTexture(gl.TEXTURE_2D, texture); });
    for (const { start, count, set } of data.groups) {
      sets[set].forEach((texture, i) => { gl.activeTexture(gl.TEXTURE0 + i); gl.bindTexture(gl.TEXTURE_2D, texture); });
      gl.uniform1i(at.hasNormal, data.sets[set].normal ? 1 : 0);
      gl.uniform1f(at.normalScale, data.sets[set].normal_scale);
      gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 4 * start);
    }
    slider.value = Math.round(state.turn);
    document.getElementById("degrees").textContent = Math.round(state.turn) + "°";
  }

  function change(values) {
    Object.assign(state, values);
    state.turn = ((state.turn % 360) + 360) % 360;
    state.elevation = Math.max(-89, Math.min(89, state.elevation));
    state.zoom = Math.max(0.25, Math.min(3, state.zoom));
    if (!waiting) requestAnimationFrame(draw);
    waiting = true;
  }

  let last = null;
  canvas.addEventListener("pointerdown", (event) => { last = [event.clientX, event.clientY]; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointerup", () => { last = null; });
  canvas.addEventListener("pointermove", (event) => {
    if (!last) return;
    const [dx, dy] = [event.clientX - last[0], event.clientY - last[1]];
    last = [event.clientX, event.clientY];
    if (event.shiftKey || event.buttons === 2) change({ turn: state.turn + 0.5 * dx });
    else change({ azimuth: state.azimuth - 0.4 * dx, elevation: state.elevation + 0.4 * dy });
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); change({ zoom: state.zoom * Math.exp(0.001 * event.deltaY) }); }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: { azimuth: state.azimuth - 5 }, ArrowRight: { azimuth: state.azimuth + 5 }, ArrowUp: { elevation: state.elevation + 5 }, ArrowDown: { elevation: state.elevation - 5 }, "+": { zoom: state.zoom * 0.9 }, "-": { zoom: state.zoom / 0.9 } }[event.key];
    if (step) { event.preventDefault(); change(step); }
  });
  slider.addEventListener("input", () => change({ turn: +slider.value === 360 ? 359.99 : +slider.value }));
  for (const choice of document.querySelectorAll("input[name=shown]")) choice.addEventListener("change", () => change({ shown: +choice.value }));
  document.getElementById("reset").addEventListener("click", () => change({ ...first, shown: state.shown }));
  new ResizeObserver(() => change({})).observe(canvas);
  draw();
  canvas.dataset.drawn = "yes";
}

start().catch((error) => {
  const hint = document.getElementById("hint");
  hint.textContent = "The 3-D view cannot be shown: " + error.message;
  hint.classList.add("wrong");
  console.error(error);
});
