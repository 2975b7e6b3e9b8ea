// SPDX-License-Identifier: Apache-2.0
#include "report/style.h"

namespace wm::tools {
namespace {

constexpr const char *kColours = R"(
:root{--paper:#fbfbf9;--card:#fff;--ink:#1a1f25;--soft:#58626d;--rule:#d8dce0;--grid:#e9ebee;--blue:#0b66b2;--band:#0b66b21c;
--truth:#1a1f25;--green:#007a5e;--orange:#cc5500;--amber:#b98200;--purple:#9a4a8c;--pale:#b9c1c9;--halo:#ffffffd9;--raster:none}
@media (prefers-color-scheme:dark){:root{--paper:#101418;--card:#171c21;--ink:#e8ebee;--soft:#9ca7b2;--rule:#313941;--grid:#242b32;
--blue:#62b2f4;--band:#62b2f426;--truth:#f4f5f6;--green:#3cc79f;--orange:#ff9452;--amber:#eab93f;--purple:#d58ac7;--pale:#55606b;
--halo:#171c21d9;--raster:invert(.88) hue-rotate(180deg)}}
)";

constexpr const char *kPicture = R"(
.frame{fill:var(--card)}.raster{filter:var(--raster)}
.grid{fill:none;stroke:var(--grid);stroke-width:1;vector-effect:non-scaling-stroke}
.truth{fill:none;stroke:var(--truth);stroke-width:4.2;stroke-linejoin:round;stroke-linecap:round;opacity:.34}
.estimate{fill:none;stroke:var(--blue);stroke-width:1.9;stroke-linejoin:round;stroke-linecap:round}
.gnss{fill:none;stroke:var(--amber);stroke-width:5;stroke-linecap:round;opacity:.7}
.cloud{fill:none;stroke:var(--purple);stroke-width:4;stroke-linecap:round}.edges{stroke:#cc5500;fill:none}
.ellipse{fill:var(--band);stroke:var(--blue);stroke-width:1}
.guess{fill:none;stroke:var(--purple);stroke-width:1.6}
.landmark{fill:var(--green);stroke:var(--card);stroke-width:1.5}
.sight{fill:none;stroke:var(--green);stroke-width:1;opacity:.55;stroke-dasharray:5 4}
.tick text,.ids text,.legend text,.start text,.end text{font:15px system-ui,-apple-system,'Segoe UI',Roboto,'DejaVu Sans',sans-serif;
fill:var(--soft);paint-order:stroke;stroke:var(--halo);stroke-width:4px;stroke-linejoin:round;font-variant-numeric:tabular-nums}
.ids text{fill:var(--green)}.legend text{fill:var(--ink);stroke:none}
.start path{fill:var(--card);stroke:var(--ink);stroke-width:2}.end path{fill:var(--orange);stroke:var(--card);stroke-width:1.5}
.start text,.end text{fill:var(--ink);font-weight:600}
.cursor{fill:var(--orange);stroke:var(--card);stroke-width:3}
)";

constexpr const char *kPage = R"(
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{margin:0;background:var(--paper);color:var(--ink);font:16px/1.55 system-ui,-apple-system,'Segoe UI',Roboto,'DejaVu Sans',sans-serif;
font-variant-numeric:tabular-nums}
main{max-width:980px;margin:0 auto;padding:40px 24px 64px}
h1{font-size:15px;line-height:1.3;font-weight:600;margin:0 0 14px;color:var(--soft)}
h2{font-size:22px;line-height:1.25;margin:56px 0 6px;letter-spacing:-.01em}
h3{font-size:16px;margin:26px 0 2px}
p{margin:0 0 12px;max-width:72ch}
.headline{font-size:25px;line-height:1.36;letter-spacing:-.012em;font-weight:500;margin:0 0 26px;max-width:52ch;text-wrap:pretty}
.headline em{font-style:normal;color:var(--blue);font-weight:650}
.how,.note{color:var(--soft)}
.how{margin-bottom:14px}
.note{font-size:14px}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(146px,1fr));gap:1px;background:var(--card);border:1px solid var(--rule);
border-radius:10px;overflow:hidden;margin:0 0 8px}
.tiles div{box-shadow:0 0 0 1px var(--rule);padding:13px 16px 12px}
.tiles b{display:block;font-size:23px;line-height:1.2;font-weight:600;letter-spacing:-.01em;white-space:nowrap}
.tiles span{display:block;font-size:13px;line-height:1.35;color:var(--soft);margin-top:3px}
figure{margin:0}
.shots{display:grid;grid-template-columns:repeat(auto-fill,minmax(300px,1fr));gap:14px}
.shot svg{display:block;width:100%;height:auto;border-radius:8px}
.shot figcaption{font-size:13px;color:var(--soft);margin-top:3px}
.shot text{fill:#ffe98a;paint-order:stroke;stroke:#000a;stroke-width:3px;stroke-linejoin:round;font-family:system-ui,'DejaVu Sans',sans-serif}
.hope{fill:none;stroke:#ffd23d;stroke-width:2;vector-effect:non-scaling-stroke}.hit{fill:#35e0a8;stroke:#063;stroke-width:1;vector-effect:non-scaling-stroke}
.edge-seen,.edge-mapped{fill:none;stroke-linecap:round;vector-effect:non-scaling-stroke}.edge-seen{stroke:#ffd23d;stroke-width:4.5}
.edge-mapped{stroke:#1fa2ff;stroke-width:1.8}
.edge-line{fill:none;stroke:#ffd23d;stroke-width:3;stroke-linecap:round;stroke-linejoin:round;vector-effect:non-scaling-stroke}
.line-seen,.line-mapped{fill:none;vector-effect:non-scaling-stroke}.line-seen{stroke:#ffd23d;stroke-width:2.2}
.line-mapped{stroke:#1fa2ff;stroke-width:1.4}
.miss{fill:#ff5b3a;stroke:#400;stroke-width:1;vector-effect:non-scaling-stroke}
.map{display:block;width:100%;height:auto;border:1px solid var(--rule);border-radius:10px;background:var(--card)}
.legend{display:flex;flex-wrap:wrap;gap:4px 20px;margin:10px 0 0;padding:0;list-style:none;font-size:14px;color:var(--soft)}
.legend li{display:flex;align-items:center;gap:8px}
.legend svg{width:28px;height:16px;flex:none;overflow:visible}
.panel{margin:0 0 4px}.panel.last{margin-bottom:34px}
.axis{display:flex;justify-content:space-between;gap:12px;font-size:14px;margin:10px 0 5px 52px;max-width:none}
.axis small{color:var(--soft);font-size:13px;text-align:right}
.plot{position:relative;margin-left:52px;background:var(--card);border:1px solid var(--rule);border-radius:4px}
.plot svg{position:absolute;inset:0;width:100%;height:100%;overflow:hidden;display:block}
.plot path{fill:none;vector-effect:non-scaling-stroke}
.plot i{position:absolute;font-style:normal;font-size:12px;line-height:1;color:var(--soft);white-space:nowrap}
.plot i.y{right:100%;transform:translate(-7px,-50%)}
.plot i.x{top:100%;transform:translate(-50%,8px)}
.plot b{position:absolute;background:var(--halo);padding:2px 4px;border-radius:3px;font-size:12px;line-height:1;font-weight:500;color:var(--soft);white-space:nowrap}
.plot b.level{right:4px;transform:translateY(-112%)}.plot b.under{right:4px;transform:translateY(12%)}
.plot b.above{transform:translate(-50%,-150%)}
.plot b.right{transform:translate(10px,-50%)}
.plot .band{fill:var(--band)}
.plot .value,.swatch .value{stroke:var(--blue);stroke-width:1.5;stroke-linejoin:round}
.plot .mean{stroke:var(--ink);stroke-width:1.6}
.plot .points{stroke:var(--blue);stroke-width:3;stroke-linecap:round;opacity:.6}
.plot .ranges{stroke:var(--blue);stroke-width:1.2;opacity:.75}
.plot .refused{stroke:var(--orange);stroke-width:5;stroke-linecap:round}
.plot .bound{stroke:var(--orange);stroke-width:1.3;stroke-dasharray:6 4}
.plot .zero{stroke:var(--soft);stroke-width:1;opacity:.6}
.plot .bar{fill:var(--blue);opacity:.45}.plot .curve{stroke:var(--ink);stroke-width:1.6}
.plot .span1{fill:var(--blue)}.plot .span2{fill:var(--blue);opacity:.5}.plot .span3{fill:var(--blue);opacity:.22}
.plot .hair{stroke:var(--orange);stroke-width:2}
.pair{display:grid;grid-template-columns:minmax(0,3fr) minmax(0,1fr);gap:0 8px}
.strip{display:flex;height:26px;border-radius:6px;overflow:hidden;border:1px solid var(--rule);margin-left:52px}
.strip span{display:block;min-width:1px}
.searching{background:var(--pale)}.tracking{background:var(--green)}.dead_reckoning{background:var(--amber)}.lost{background:var(--orange)}.degraded{background:var(--orange)}
.degraded{background-image:repeating-linear-gradient(90deg,#0003 0 2px,#0000 2px 6px)}
.dead_reckoning{background-image:repeating-linear-gradient(45deg,#0003 0 3px,#0000 3px 7px)}
.lost{background-image:repeating-linear-gradient(-45deg,#0004 0 4px,#0000 4px 8px)}
.key{display:inline-block;width:16px;height:16px;border-radius:4px;flex:none}
.wide{overflow-x:auto}
.findings{list-style:none;padding:0;margin:12px 0}
.findings li{border-left:4px solid var(--amber);padding:2px 0 4px 14px;margin:0 0 18px;overflow-wrap:anywhere}
.findings li.bad{border-color:var(--orange)}.findings p{margin:4px 0 0}.findings p:first-of-type{color:var(--soft)}
.findings code{font-size:13px;color:var(--soft)}
table{border-collapse:collapse;font-size:14px;width:100%;margin:4px 0 8px}
th{font-weight:500;color:var(--soft);text-align:right;padding:6px 0 6px 16px;border-bottom:1px solid var(--rule);vertical-align:bottom}
td{text-align:right;padding:7px 0 7px 16px;border-bottom:1px solid var(--grid);vertical-align:top;white-space:nowrap}
th:first-child,td:first-child{text-align:left;padding-left:0}
td.words,th.words{text-align:left;white-space:normal;min-width:15em;color:var(--soft)}
td.some{color:var(--orange);font-weight:600}
.share{display:flex;height:8px;border-radius:4px;overflow:hidden;background:var(--grid);min-width:90px;margin-top:7px}
.share i{display:block}.share .f{background:var(--blue)}.share .r{background:var(--orange)}.share .d{background:var(--amber)}
details{margin:18px 0}summary{cursor:pointer;color:var(--soft)}
footer{margin-top:64px;padding-top:16px;border-top:1px solid var(--rule);font-size:13px;color:var(--soft)}
#readout{position:fixed;left:50%;bottom:18px;transform:translateX(-50%);background:var(--ink);color:var(--paper);font-size:14px;padding:7px 14px;
border-radius:99px;white-space:nowrap;pointer-events:none;opacity:0;transition:opacity .15s;max-width:96vw}
.hair-line{position:absolute;top:0;bottom:0;width:1px;background:var(--orange);pointer-events:none;display:none}
@media (max-width:620px){main{padding:26px 15px 48px}.headline{font-size:21px}h2{margin-top:44px}.plot,.axis,.strip{margin-left:40px}
.plot i.spare{display:none}.pair{grid-template-columns:minmax(0,1fr)}.tiles{grid-template-columns:1fr 1fr}.axis{flex-wrap:wrap;gap:0 12px}.axis small{text-align:left}
.map .tick text,.map .start text,.map .end text{font-size:31px}.map .ids text{font-size:24px}.map .ids .spare{display:none}
.map .estimate{stroke-width:3.4}.map .truth{stroke-width:7.5}.map .sight{stroke-width:2}.map .landmark{stroke-width:1}}
@media print{:root{--paper:#fff;--card:#fff;--ink:#000;--soft:#444;--rule:#bbb;--grid:#e4e4e4;--blue:#0b66b2;--band:#0b66b21c;--truth:#000;
--green:#007a5e;--orange:#cc5500;--amber:#b98200;--purple:#9a4a8c;--pale:#b9c1c9;--halo:#ffffffd9;--raster:none}
body{font-size:10.5pt;-webkit-print-color-adjust:exact;print-color-adjust:exact}main{max-width:none;padding:0}h2{margin-top:26px}
h2,h3,.how,.axis{break-after:avoid}figure,.panel,.pair,table,.tiles{break-inside:avoid}#readout,.hair-line{display:none!important}
details:not([open])>*{display:none}@page{margin:16mm}}
)";

}  // namespace

std::string page_colours() { return kColours; }

std::string page_style() { return std::string(kColours) + kPicture + kPage; }

std::string picture_style_alone() { return std::string(kColours) + kPicture + ".paper{fill:var(--paper)}"; }

}  // namespace wm::tools
