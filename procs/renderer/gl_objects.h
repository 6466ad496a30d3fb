// OpenGL objects that free themselves, and the few ways in which this library makes them.
#pragma once

#include <epoxy/gl.h>

#include <string>
#include <utility>

namespace foresight {

/// Owns one GL name. `Free` deletes it.
template <void (*Free)(GLuint)>
class GlObject {
 public:
  GlObject() = default;
  explicit GlObject(GLuint name) : name_(name) {}
  GlObject(GlObject&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlObject& operator=(GlObject&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  ~GlObject() {
    if (name_ != 0) Free(name_);
  }
  GLuint name() const { return name_; }

 private:
  GLuint name_ = 0;
};

void free_texture(GLuint name);
void free_buffer(GLuint name);
void free_vertex_array(GLuint name);
void free_framebuffer(GLuint name);
void free_renderbuffer(GLuint name);
void free_program(GLuint name);

using GlTexture = GlObject<free_texture>;
using GlBuffer = GlObject<free_buffer>;
using GlVertexArray = GlObject<free_vertex_array>;
using GlFramebuffer = GlObject<free_framebuffer>;
using GlRenderbuffer = GlObject<free_renderbuffer>;
using GlProgram = GlObject<free_program>;

GlBuffer make_buffer();
GlVertexArray make_vertex_array();
GlFramebuffer make_framebuffer();

/// A 2D texture without mipmaps, clamped at its edges.
GlTexture make_texture(GLenum internal_format, int width, int height, GLenum filter);
/// The same with layers. Cleared to zero is not promised.
GlTexture make_texture_array(GLenum internal_format, int width, int height, int layers,
                             GLenum filter);
GlRenderbuffer make_depth_buffer(int width, int height);

/// Compiles and links; throws GlError with the shader's name and the driver's first line.
GlProgram make_program(const std::string& name, const std::string& vertex_source,
                       const std::string& fragment_source);

/// Throws GlError when the bound framebuffer is not complete.
void require_complete_framebuffer(const std::string& name);

}  // namespace foresight
