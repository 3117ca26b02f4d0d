// Two rectangles on each other: the simplest bodies, for exact solutions.
//
// Lengths in mm; x from their middle, z up from the contact. Structured quadrilaterals.
// Physical groups: every name starts with the body it belongs to, punch_ or strip_.

DefineConstant[
  width = 1,
  punch_height = 1,
  strip_height = 1,
  margin = 0,          // by which the strip is wider on each side
  margin_elements = 2, // over each margin
  core = 0,            // width of the evenly divided middle; 0: all of it
  across = 2,          // elements over the core; even, so that a node lies at x = 0
  strip_across = 0,    // of the strip where it has others than the punch; 0: the same
  outer = 1,           // elements on each side of the core
  spread = 1,          // of such an element's width over that of its neighbour towards the core
  punch_layers = 2,    // elements over the height
  strip_layers = 2,
  growth = 1,          // of an element's height over that of its neighbour towards the contact
  diffusion_length = 0  // diffusivity over the speed of a strip that slides one way, mm; 0: not known
];

If(diffusion_length < 0)
  Error("diffusion_length must not be negative");
EndIf
If(width <= 0 || punch_height <= 0 || strip_height <= 0 || core < 0 || core > width)
  Error("width, punch_height and strip_height must be positive, core between 0 and width");
EndIf
If(margin < 0 || margin_elements < 1)
  Error("margin must not be negative, margin_elements at least 1");
EndIf
If(across < 2 || across % 2 != 0 || strip_across < 0 || strip_across % 2 != 0)
  Error("across and strip_across must be even");
EndIf
If(punch_layers < 1 || strip_layers < 1 || outer < 1)
  Error("punch_layers, strip_layers and outer must be at least 1");
EndIf
If(growth <= 0 || spread <= 0)
  Error("growth and spread must be positive");
EndIf

// At the strip's surface elements are at most as high as the layer that heats up while it passes.
layer = Sqrt(diffusion_length * width);
whole = 0;
For i In {0 : strip_layers - 1}
  whole += growth^i;
EndFor
top_growth = growth;
If(layer > 0 && strip_height / whole > layer)
  top_growth = (growth > 1.5) ? growth : 1.5;
  top_count = Ceil(Log(1 + (top_growth - 1) * strip_height / layer) / Log(top_growth));
  strip_layers = (top_count > strip_layers) ? top_count : strip_layers;
EndIf
growths[] = {growth, top_growth};

heights[] = {punch_height, -strip_height};
layers[] = {punch_layers, strip_layers};
counts[] = {across, (strip_across > 0) ? strip_across : across};
For body In {0 : 1}
  // Where its columns of elements begin on either side, how many they are and the ratio of their widths.
  abscissae[] = {0, (core > 0) ? core / 2 : width / 2}; columns[] = {counts[body] / 2}; ratios[] = {1};
  If(core > 0 && core < width)
    abscissae[] += {width / 2}; columns[] += {outer}; ratios[] += {spread};
  EndIf
  If(body == 1 && margin > 0)
    abscissae[] += {width / 2 + margin}; columns[] += {margin_elements}; ratios[] += {1};
  EndIf
  last = #abscissae[] - 1;
  a = newp; Point(a) = {0, 0, 0};
  b = newp; Point(b) = {0, heights[body], 0};
  middle = newl; Line(middle) = {a, b};
  uprights[] = {middle}; contact~{body}[] = {}; ends~{body}[] = {}; sides~{body}[] = {}; parts~{body}[] = {};
  For side In {-1 : 1 : 2}    // both halves from the middle outwards: mirror images to the last digit
    near = a; far = b; upright = middle;
    For i In {1 : last}
      p = newp; Point(p) = {side * abscissae[i], 0, 0};
      q = newp; Point(q) = {side * abscissae[i], heights[body], 0};
      l = newl; Line(l) = {near, p};
      m = newl; Line(m) = {far, q};
      u = newl; Line(u) = {p, q};
      Transfinite Curve{l, m} = columns[i - 1] + 1 Using Progression ratios[i - 1];
      c = newll; Curve Loop(c) = {l, u, -m, -upright};
      s = news; Plane Surface(s) = {c};
      contact~{body}[] += l; ends~{body}[] += m; uprights[] += u; parts~{body}[] += s;
      near = p; far = q; upright = u;
    EndFor
    sides~{body}[] += upright;
  EndFor
  Transfinite Curve{uprights[]} = layers[body] + 1 Using Progression growths[body];
EndFor

Transfinite Surface{:};
Recombine Surface{:};

Physical Surface("punch_body") = parts_0[];
Physical Curve("punch_contact") = contact_0[];
Physical Curve("punch_far") = ends_0[];
Physical Curve("punch_sides") = sides_0[];
Physical Surface("strip_body") = parts_1[];
Physical Curve("strip_contact") = contact_1[];
Physical Curve("strip_far") = ends_1[];
Physical Curve("strip_sides") = sides_1[];
