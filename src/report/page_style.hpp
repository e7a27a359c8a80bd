#pragma once

namespace pliant {

/// The report page's style sheet: one column, light or dark by the reader's setting, printable.
inline constexpr const char* page_style = R"css(
:root{--paper:#fbfbfa;--card:#fff;--ink:#22262b;--muted:#667080;--grid:#e4e6e9;--accent:#2f6fb3;--accent-soft:#e8f0f9;
--series-0:#2f6fb3;--series-1:#d2691e;--series-2:#3c8d5a;--series-3:#8b5fbf;--series-4:#b8860b;--series-5:#c0436a}
@media(prefers-color-scheme:dark){:root{--paper:#16181b;--card:#1e2125;--ink:#e6e8ea;--muted:#98a2ae;--grid:#33383e;
--accent:#7db4ee;--accent-soft:#1f2d3d;--series-0:#7db4ee;--series-1:#f0a060;--series-2:#7ccf9b;--series-3:#c0a0ea;
--series-4:#e0c060;--series-5:#f08aac}}
*{box-sizing:border-box}
body{margin:0;background:var(--paper);color:var(--ink);font:16px/1.55 system-ui,-apple-system,"Segoe UI",sans-serif}
main{max-width:980px;margin:0 auto;padding:36px 20px 60px}
h1{font-size:1.75rem;line-height:1.2;margin:0 0 .2rem;font-weight:650}
h2{font-size:1.15rem;margin:2.4rem 0 .7rem;font-weight:650}
h3{font-size:1rem;margin:1.6rem 0 .5rem;font-weight:620}h3::first-letter{text-transform:uppercase}
.sub{color:var(--muted);margin:0 0 1.6rem}
.verdict{border-left:4px solid var(--series-2);padding:.3rem 0 .3rem .8rem;margin:0 0 1.4rem}
.verdict.unexplained{border-color:var(--series-5)}.verdict.undetermined{border-color:var(--series-4)}
.cards{display:grid;grid-template-columns:repeat(auto-fill,minmax(215px,1fr));gap:14px}
.card{background:var(--card);border:1px solid var(--grid);border-radius:10px;padding:14px 16px}
.card .name{color:var(--muted);font-size:.85rem}
.card .value{font-size:1.06rem;white-space:nowrap;font-weight:620;margin:.15rem 0 .5rem;font-variant-numeric:tabular-nums}
.card .value.vector{font-size:.92rem;white-space:normal}
.card .from{color:var(--muted);font-size:.8rem}
.card svg{display:block;width:100%;height:16px;margin-bottom:.35rem}
ul.words{margin:.2rem 0 0;padding-left:1.15rem}ul.words li{margin:.3rem 0}
.panel{background:var(--card);border:1px solid var(--grid);border-radius:10px;padding:12px 14px;margin:0 0 14px}
.plot{display:block;width:100%;height:auto}
.small-plots{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(400px,100%),1fr));gap:14px}
.pictures{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(380px,100%),1fr));gap:14px}
.pictures+.panel{margin-top:14px}
figure{margin:0;background:var(--card);border:1px solid var(--grid);border-radius:10px;overflow:hidden}
figure img{display:block;width:100%;height:auto}
figcaption{padding:8px 14px;color:var(--muted);font-size:.88rem}
.scale{max-width:520px;margin:0 0 12px}.scale svg{display:block;width:100%;height:auto}
.table{overflow-x:auto}table{border-collapse:collapse;width:100%;font-size:.92rem;font-variant-numeric:tabular-nums}
th{font-weight:600;text-align:left;color:var(--muted);font-size:.82rem}
th,td{padding:7px 12px 7px 0;border-bottom:1px solid var(--grid);vertical-align:top}
td.cell{text-align:center;padding:7px 4px;min-width:64px}
.given{color:var(--muted)}
pre{background:var(--card);border:1px solid var(--grid);border-radius:10px;padding:12px 16px;overflow-x:auto;
font:.88rem/1.5 ui-monospace,SFMono-Regular,Menlo,monospace}
code{font:.92em ui-monospace,SFMono-Regular,Menlo,monospace}
footer{margin-top:2.6rem;color:var(--muted);font-size:.84rem;border-top:1px solid var(--grid);padding-top:12px}
@media print{main{max-width:none}.card,.panel,figure{break-inside:avoid}}
)css";

}  // namespace pliant
