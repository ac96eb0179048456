# Writes a script as C++: cmake -DSCRIPT=plot.js -DOUT=plot_script.cpp -P embed_script.cmake
file(READ ${SCRIPT} hex HEX)
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," content "${hex}")
string(LENGTH "${hex}" digits)
math(EXPR bytes "${digits} / 2")
file(
  WRITE ${OUT}
  "#include \"tools/report/plot_script.h\"\n\nnamespace rcs::report {\nnamespace {\nconstexpr char kScript[] = {${content}0};\n}  // namespace\n\nstd::string_view plot_script() { return {kScript, ${bytes}}; }\n\n}  // namespace rcs::report\n"
)
