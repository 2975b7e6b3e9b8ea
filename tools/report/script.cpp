// SPDX-License-Identifier: Apache-2.0
#include "report/script.h"

namespace wm::tools {

std::string page_script() {
  return R"js(
(() => {
  const from = +document.body.dataset.from, to = +document.body.dataset.to;
  const plots = [...document.querySelectorAll('.plot.time')];
  const dot = document.querySelector('.map .cursor'), readout = document.getElementById('readout');
  const hairs = plots.map(plot => {
    const hair = document.createElement('span');
    hair.className = 'hair-line';
    plot.append(hair);
    return hair;
  });
  const length = m => m < 0.01 ? (m * 1000).toFixed(1) + ' mm' : m < 1 ? (m * 100).toFixed(1) + ' cm' : m.toFixed(2) + ' m';
  const clock = s => s < 100 ? s.toFixed(1) + ' s' : Math.floor(s / 60) + ' min ' + Math.floor(s % 60) + ' s';
  const nearest = t => {
    let low = 0, high = track.length - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (track[middle][0] < t) low = middle + 1; else high = middle;
    }
    return track[low];
  };
  const show = share => {
    const [t, x, y, off] = nearest(from + share * (to - from));
    hairs.forEach(hair => { hair.style.left = 100 * share + '%'; hair.style.display = 'block'; });
    dot.setAttribute('cx', x);
    dot.setAttribute('cy', y);
    dot.setAttribute('visibility', 'visible');
    readout.textContent = clock(t) + ' after the start' + (off === null ? '' : ': off by ' + length(off));
    readout.style.opacity = 1;
  };
  const hide = () => {
    hairs.forEach(hair => hair.style.display = 'none');
    dot.setAttribute('visibility', 'hidden');
    readout.style.opacity = 0;
  };
  plots.forEach(plot => {
    plot.addEventListener('pointermove', event => {
      const box = plot.getBoundingClientRect();
      show(Math.min(1, Math.max(0, (event.clientX - box.left) / box.width)));
    });
    plot.addEventListener('pointerleave', hide);
  });
})();
)js";
}

}  // namespace wm::tools
