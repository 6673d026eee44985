// The page: a .glb under ambient light alone, and functions that show.mjs calls.
//
// measure() gives what the shader computes, as floats, before any colour management, and the point of the world that
// each pixel shows, so that whoever asks can look up by himself what the occlusion there ought to be.
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const WIDTH = 560, HEIGHT = 420;
const AMBIENT = Math.PI; // of a white surface comes 1

const scene = new THREE.Scene();
scene.add(new THREE.AmbientLight(0xffffff, AMBIENT));
const camera = new THREE.PerspectiveCamera(38, WIDTH / HEIGHT, 0.1, 100);
camera.position.set(3.0, 3.1, 5.6);
camera.lookAt(0, 0.6, 0);

async function load(url) {
  const file = await new GLTFLoader().loadAsync(url);
  scene.add(file.scene);
  return meshes().map((mesh) => ({ name: mesh.name, channel: mesh.material.aoMap ? mesh.material.aoMap.channel : null }));
}

function meshes() {
  const found = [];
  scene.traverse((node) => node.isMesh && found.push(node));
  return found;
}

function setIntensity(intensity) {
  for (const { material } of meshes()) material.aoMapIntensity = intensity;
}

function draw() {
  for (const [id, intensity] of [["without", 0], ["with", 1]]) {
    const renderer = new THREE.WebGLRenderer({ canvas: document.getElementById(id), antialias: true });
    renderer.setSize(WIDTH, HEIGHT);
    renderer.setClearColor(0xffffff);
    setIntensity(intensity);
    renderer.render(scene, camera);
  }
}

const PLACE = new THREE.ShaderMaterial({
  side: THREE.DoubleSide,
  vertexShader: `varying vec3 place;
    void main() {
      vec4 world = modelMatrix * vec4(position, 1.0);
      place = world.xyz;
      gl_Position = projectionMatrix * viewMatrix * world;
    }`,
  fragmentShader: "varying vec3 place; void main() { gl_FragColor = vec4(place, 1.0); }",
});

function measure() {
  const renderer = new THREE.WebGLRenderer();
  renderer.setClearColor(0x000000, 0);
  const target = new THREE.WebGLRenderTarget(WIDTH, HEIGHT, { type: THREE.FloatType });
  const pixels = (override) => {
    scene.overrideMaterial = override;
    renderer.setRenderTarget(target);
    renderer.render(scene, camera);
    const values = new Float32Array(WIDTH * HEIGHT * 4);
    renderer.readRenderTargetPixels(target, 0, 0, WIDTH, HEIGHT, values);
    return base64(values);
  };
  for (const { material } of meshes()) { // mip maps would blur what is compared
    material.aoMap.minFilter = THREE.LinearFilter;
    material.aoMap.needsUpdate = true;
  }
  const lit = [0, 1].map((intensity) => { setIntensity(intensity); return pixels(null); });
  return { place: pixels(PLACE), without: lit[0], with: lit[1] };
}

function base64(values) {
  const bytes = new Uint8Array(values.buffer);
  let text = "";
  for (let start = 0; start < bytes.length; start += 32768) {
    text += String.fromCharCode(...bytes.subarray(start, start + 32768));
  }
  return btoa(text);
}

Object.assign(window, { load, draw, measure, ready: true });
