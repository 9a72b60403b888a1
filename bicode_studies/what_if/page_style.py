"""How the what-if page looks: one grid, two columns where there is room and one where there is not."""

STYLE = """<style>
.bicode-page { display: grid !important; overflow: visible; max-width: 1240px; margin: 0 auto; gap: 8px 28px;
  grid-template-columns: 370px minmax(0, 320px) minmax(0, 1fr); grid-template-rows: auto auto auto 1fr;
  grid-template-areas: "title title title" "controls verdict verdict" "controls packet packet" "controls frame budget";
  font-size: 14px; }
.bicode-page .widget-html-content { line-height: 1.4; }
.bicode-title { grid-area: title; height: auto !important; }
.bicode-title h2, .bicode-title p { margin: 0; }
[data-voila] .jp-Cell, [data-voila] .jp-Cell :has(.bicode-page) { overflow: visible !important; }
.bicode-page > * { min-width: 0; }
.bicode-page > :first-child { display: none; }
.bicode-page .widget-box, .bicode-page .jupyter-widgets { overflow: visible; }
.bicode-controls { grid-area: controls; } .bicode-packet { grid-area: packet; } .bicode-frame { grid-area: frame; }
.bicode-budget { grid-area: budget; } .bicode-verdict { grid-area: verdict; }
.bicode-page h3 { margin: 10px 0 2px; font-size: 15px; border-bottom: 1px solid #ccc; }
.bicode-controls .widget-slider, .bicode-controls .widget-inline-hbox { width: 100%; }
.bicode-controls .widget-label { width: 112px; min-width: 112px; text-align: left; }
.bicode-controls .widget-readout { min-width: 72px; text-align: right; overflow: visible; }
.bicode-controls .widget-toggle-button { width: 70px; }
.bicode-controls .widget-button { width: auto; }
.bicode-words { height: auto !important; } .bicode-words p { margin: 0 0 6px; padding: 4px 8px; border-radius: 4px; }
.bicode-words .mind { background: #FFF4D6; color: #5A4300; }
.bicode-words .impossible, .bicode-verdict .refusal { background: #FBE3D6; color: #7A2600; }
.bicode-verdict { position: sticky; top: 0; z-index: 5; margin: 0; padding: 8px 0 4px; background: white;
  height: auto !important; }
.bicode-verdict .cards { display: grid; grid-template-columns: repeat(4, 1fr); gap: 8px; }
.bicode-verdict .cards div { background: #F2F4F7; border-radius: 6px; padding: 6px 10px; display: flex;
  flex-direction: column; }
.bicode-verdict .cards b { font-size: 22px; } .bicode-verdict small { color: #555; font-size: 12px; }
.bicode-verdict .said { margin: 6px 2px 2px; font-size: 15px; }
.bicode-verdict .refusal { border-radius: 6px; padding: 8px 14px; } .bicode-verdict .refusal h2 { margin: 0 0 4px; }
.bicode-verdict .refusal p { margin: 2px 0; }
img.bicode-packet { width: 100%; height: auto; max-width: 800px; }
img.bicode-frame { width: 100%; height: auto; max-width: 320px; justify-self: center; align-self: start; }
.bicode-stale { opacity: 0.35; }
.bicode-budget table { border-collapse: collapse; } .bicode-budget td { padding: 3px 18px 3px 0; }
.bicode-budget td:last-child { text-align: right; font-variant-numeric: tabular-nums; }
.bicode-budget p { color: #555; margin: 4px 0; }
@media (max-width: 800px) {
  .bicode-page { grid-template-columns: minmax(0, 1fr); grid-template-rows: none;
    grid-template-areas: "title" "verdict" "packet" "controls" "frame" "budget"; }
  .bicode-title h2 { font-size: 18px; } .bicode-title p { display: none; }
  .bicode-verdict .cards { gap: 4px; }
  .bicode-verdict .cards div { padding: 4px 6px; } .bicode-verdict .cards b { font-size: 15px; }
  .bicode-verdict .cards small:last-child { display: none; }
}
</style>"""
