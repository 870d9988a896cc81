// SPDX-License-Identifier: MIT
// A body that stands as the robot does, of six planes turned by CSS: it needs no WebGL.
// Robot's frame: x forward (the orange side), y left, z up. The eye is behind it, a little to the
// left and above.
const SIZE = { x: 200, y: 130, z: 26 };
const SIDES = [ // name, width, height, transform, colour
  ["top", SIZE.y, SIZE.x, `rotateX(90deg) translateZ(${SIZE.z / 2}px)`, "#3d8fc4"],
  ["bottom", SIZE.y, SIZE.x, `rotateX(-90deg) translateZ(${SIZE.z / 2}px)`, "#1d4d6d"],
  ["back", SIZE.y, SIZE.z, `translateZ(${SIZE.x / 2}px)`, "#2a6f9b"],
  ["front", SIZE.y, SIZE.z, `rotateY(180deg) translateZ(${SIZE.x / 2}px)`, "#e07b28"],
  ["left", SIZE.x, SIZE.z, `rotateY(-90deg) translateZ(${SIZE.y / 2}px)`, "#225c82"],
  ["right", SIZE.x, SIZE.z, `rotateY(90deg) translateZ(${SIZE.y / 2}px)`, "#225c82"],
];

export default {
  template: `<div role="img" aria-label="the body as it stands"
      style="height:300px;perspective:900px;display:flex;align-items:center;justify-content:center">
    <div style="transform-style:preserve-3d;transform:rotateX(-22deg) rotateY(28deg)">
      <div ref="body" style="position:relative;width:0;height:0;transform-style:preserve-3d">
        <div v-for="s in sides" :key="s[0]" :style="style(s)">{{ s[0] }}</div>
      </div>
    </div></div>`,
  data: () => ({ sides: SIDES }),
  methods: {
    style([, width, height, transform, colour]) {
      return {
        position: "absolute", width: width + "px", height: height + "px",
        left: -width / 2 + "px", top: -height / 2 + "px", transform, background: colour,
        border: "1px solid rgba(0,0,0,.5)", color: "#fff", font: "12px sans-serif",
        display: "flex", alignItems: "center", justifyContent: "center",
      };
    },
    turn(roll, pitch, yaw) { // radians
      const [cr, sr, cp, sp, cy, sy] = [roll, pitch, yaw].flatMap((a) => [Math.cos(a), Math.sin(a)]);
      const r = [ // robot to earth
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
      ];
      const at = [1, 2, 0]; // CSS axes (right, down, to the eye) are (-y, -z, -x)
      const m = [];
      for (let column = 0; column < 3; column++) {
        for (let row = 0; row < 3; row++) m.push(r[at[row]][at[column]]);
        m.push(0);
      }
      this.$refs.body.style.transform = `matrix3d(${m.map((v) => v.toFixed(5)).join(",")},0,0,0,1)`;
    },
  },
};
