#include "procs/renderer/gl_objects.h"

#include <algorithm>

#include "procs/renderer/gl_context.h"

namespace foresight {

void free_texture(GLuint name) { glDeleteTextures(1, &name); }
void free_buffer(GLuint name) { glDeleteBuffers(1, &name); }
void free_vertex_array(GLuint name) { glDeleteVertexArrays(1, &name); }
void free_framebuffer(GLuint name) { glDeleteFramebuffers(1, &name); }
void free_renderbuffer(GLuint name) { glDeleteRenderbuffers(1, &name); }
void free_program(GLuint name) { glDeleteProgram(name); }

GlBuffer make_buffer() {
  GLuint name = 0;
  glGenBuffers(1, &name);
  return GlBuffer(name);
}

GlVertexArray make_vertex_array() {
  GLuint name = 0;
  glGenVertexArrays(1, &name);
  return GlVertexArray(name);
}

GlFramebuffer make_framebuffer() {
  GLuint name = 0;
  glGenFramebuffers(1, &name);
  return GlFramebuffer(name);
}

namespace {

GlTexture begin_texture(GLenum target, GLenum filter) {
  GLuint name = 0;
  glGenTextures(1, &name);
  glBindTexture(target, name);
  glTexParameteri(target, GL_TEXTURE_MIN_FILTER, static_cast<GLint>(filter));
  glTexParameteri(target, GL_TEXTURE_MAG_FILTER, static_cast<GLint>(filter));
  glTexParameteri(target, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(target, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glTexParameteri(target, GL_TEXTURE_MAX_LEVEL, 0);
  return GlTexture(name);
}

/// A client format that fits the internal one; no data is sent with it.
GLenum format_of(GLenum internal_format) { return internal_format == GL_R32F ? GL_RED : GL_RGBA; }

std::string first_line(std::string log) {
  log.erase(std::find(log.begin(), log.end(), '\n'), log.end());
  return log;
}

void compile(GLuint shader, const std::string& name, const std::string& source) {
  const char* text = source.c_str();
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  GLint good = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (good == GL_TRUE) return;
  std::string log(2000, '\0');
  GLsizei length = 0;
  glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), &length, log.data());
  log.resize(static_cast<size_t>(length));
  throw GlError("shader " + name + " does not compile: " + first_line(log) +
                " (the driver must support OpenGL 3.3)");
}

}  // namespace

GlTexture make_texture(GLenum internal_format, int width, int height, GLenum filter) {
  GlTexture texture = begin_texture(GL_TEXTURE_2D, filter);
  glTexImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(internal_format), width, height, 0,
               format_of(internal_format), GL_UNSIGNED_BYTE, nullptr);
  return texture;
}

GlTexture make_texture_array(GLenum internal_format, int width, int height, int layers,
                             GLenum filter) {
  GlTexture texture = begin_texture(GL_TEXTURE_2D_ARRAY, filter);
  glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, static_cast<GLint>(internal_format), width, height, layers,
               0, format_of(internal_format), GL_UNSIGNED_BYTE, nullptr);
  return texture;
}

GlRenderbuffer make_depth_buffer(int width, int height) {
  GLuint name = 0;
  glGenRenderbuffers(1, &name);
  glBindRenderbuffer(GL_RENDERBUFFER, name);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, width, height);
  return GlRenderbuffer(name);
}

GlProgram make_program(const std::string& name, const std::string& vertex_source,
                       const std::string& fragment_source) {
  GlProgram program(glCreateProgram());
  for (const auto& [kind, source] :
       {std::pair<GLenum, const std::string&>{GL_VERTEX_SHADER, vertex_source},
        {GL_FRAGMENT_SHADER, fragment_source}}) {
    const GLuint shader = glCreateShader(kind);
    glAttachShader(program.name(), shader);
    glDeleteShader(shader);  // lives on inside the program
    compile(shader, name, source);
  }
  glLinkProgram(program.name());
  GLint good = 0;
  glGetProgramiv(program.name(), GL_LINK_STATUS, &good);
  if (good != GL_TRUE) throw GlError("shader " + name + " does not link; update the GL driver");
  return program;
}

void require_complete_framebuffer(const std::string& name) {
  const GLenum status = glCheckFramebufferStatus(GL_FRAMEBUFFER);
  if (status == GL_FRAMEBUFFER_COMPLETE) return;
  throw GlError("framebuffer " + name + " is not supported (status " + std::to_string(status) +
                "): use a driver with float render targets, e.g. LIBGL_ALWAYS_SOFTWARE=1");
}

}  // namespace foresight
