// With node at build time the three files are in the program as they are on the disk, compressed.
#include "studio/page.hpp"

namespace tandem::studio {

#ifdef TANDEM_STUDIO_DIST

// NOLINTBEGIN: the assembler's names
#define TANDEM_EMBED(name, file)                                          \
  __asm__(                                                                \
      ".pushsection .rodata\n"                                            \
      ".global tandem_studio_" #name "\n.hidden tandem_studio_" #name     \
      "\n"                                                                \
      ".global tandem_studio_" #name "_end\n.hidden tandem_studio_" #name \
      "_end\n"                                                            \
      "tandem_studio_" #name ":\n.incbin \"" TANDEM_STUDIO_DIST "/" file  \
      "\"\n"                                                              \
      "tandem_studio_" #name "_end:\n.byte 0\n.popsection\n");            \
  extern "C" const char tandem_studio_##name[], tandem_studio_##name##_end[];

TANDEM_EMBED(html, "index.html.gz")
TANDEM_EMBED(js, "studio.js.gz")
TANDEM_EMBED(css, "studio.css.gz")
// NOLINTEND

std::span<const Asset> assets() {
  static const Asset kAssets[] = {
      {"/", "text/html; charset=utf-8", {tandem_studio_html, tandem_studio_html_end}, true},
      {"/studio.js",
       "text/javascript; charset=utf-8",
       {tandem_studio_js, tandem_studio_js_end},
       true},
      {"/studio.css", "text/css; charset=utf-8", {tandem_studio_css, tandem_studio_css_end}, true},
  };
  return kAssets;
}

#else

std::span<const Asset> assets() {
  static constexpr Asset kAssets[] = {
      {"/", "text/html; charset=utf-8", R"(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Tandem studio</title></head>
<body><h1>Tandem studio</h1>
<p>This program was built without the studio's page: that takes node and npm. In the folder of the
sources run <code>scripts/install-node-modules</code>, then <code>make</code> again.</p>
<p>The data are here all the same: <code>/ws</code> speaks tandem.studio.v1, which docs/studio.md
describes; <code>/robot.urdf</code> is the robot's description.</p>
</body></html>
)"},
  };
  return kAssets;
}

#endif

}  // namespace tandem::studio
