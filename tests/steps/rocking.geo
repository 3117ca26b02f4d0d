// A block that is held and a wider one below it that may rock on a pin, or lie on the load alone. Lengths in mm.
halves[] = {2, 4}; heights[] = {2, -2}; columns[] = {8, 16};
For body In {0 : 1}
  a = newp; Point(a) = {-halves[body], 0, 0};
  b = newp; Point(b) = {0, 0, 0};
  c = newp; Point(c) = {halves[body], 0, 0};
  d = newp; Point(d) = {halves[body], heights[body], 0};
  e = newp; Point(e) = {0, heights[body], 0};
  f = newp; Point(f) = {-halves[body], heights[body], 0};
  l = newl; Line(l) = {a, b}; Line(l + 1) = {b, c}; Line(l + 2) = {c, d}; Line(l + 3) = {d, e};
  Line(l + 4) = {e, f}; Line(l + 5) = {f, a}; Line(l + 6) = {b, e};
  Curve Loop(l) = {l, l + 6, l + 4, l + 5};
  Curve Loop(l + 1) = {l + 1, l + 2, l + 3, -(l + 6)};
  s = news; Plane Surface(s) = {l}; Plane Surface(s + 1) = {l + 1};
  Transfinite Curve{l, l + 1, l + 3, l + 4} = columns[body] + 1;
  Transfinite Curve{l + 2, l + 5, l + 6} = 5;
  If(body == 0)
    Physical Surface("punch_body") = {s, s + 1};
    Physical Curve("punch_contact") = {l, l + 1};
    Physical Curve("punch_far") = {l + 3, l + 4};
  Else
    Physical Surface("strip_body") = {s, s + 1};
    Physical Curve("strip_contact") = {l, l + 1};
    Physical Curve("strip_right") = {l + 3};
    Physical Curve("strip_left") = {l + 4};
    Physical Point("strip_pin") = {e};
  EndIf
EndFor
Transfinite Surface{:};
Recombine Surface{:};
