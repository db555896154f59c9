!! Modes followed by the matrix exponential, together with the excitation that acts on them.
!!
!! For modes η with η'' + B η' + K η = f0 + Σ Re(F_t e^{iω_t t}) the state x = (u η, η', 1, cos_t, sin_t …), each entry
!! scaled to be of the size of η', obeys x' = T x exactly. Nothing is divided by a small or vanishing eigenvalue, so that
!! very slow modes, critical damping and undamped resonance lose no digits; the price is a matrix product a step.
module razy_exact_closed_form_dense_part
   use razy_core_kinds, only: wp
   use razy_exact_modal_basis, only: dense_modes_t
   use razy_linalg_dense, only: felt
   implicit none(type, external)
   private

   public :: dense_part_t, new_dense_part

   type :: dense_part_t
      !> States d of the motion alone, in front of the others.
      integer :: states = 0
      !> Modes (m, s) and the factor u, rad/s.
      real(wp), allocatable :: phi(:, :)
      real(wp) :: unit = 1.0_wp
      !> T (nx, nx), 1/s, and its largest column sum.
      real(wp), allocatable :: matrix(:, :)
      real(wp) :: norm = 0.0_wp
      !> Tones that act here, and their scales; scale of the constant load (0: none acts).
      integer, allocatable :: tone(:)
      real(wp), allocatable, private :: tone_scale(:)
      real(wp), private :: load_scale = 0.0_wp
   contains
      procedure :: start
      procedure :: add_state
      procedure :: row
   end type dense_part_t

contains

   !> The part for `modes` under the constant force `load` (m) and phasors `harmonic` (m, tones) of frequencies `omega`; those
   !> with a `slope` are straight lines.
   pure subroutine new_dense_part(self, modes, load, harmonic, omega, slope)
      type(dense_part_t), intent(out) :: self
      type(dense_modes_t), intent(in) :: modes
      real(wp), intent(in) :: load(:), omega(:), slope(:)
      complex(wp), intent(in) :: harmonic(:, :)

      real(wp), allocatable :: force(:)
      complex(wp), allocatable :: phasor(:, :)
      integer :: d, i, nx, t

      self%unit = merge(modes%fastest, 1.0_wp, modes%fastest > 0.0_wp)
      self%phi = modes%phi
      self%states = 2*size(modes%phi, 2)
      force = [(felt(load, modes%phi(:, i)), i=1, size(modes%phi, 2))]
      phasor = reshape([((felt(cmplx(modes%phi(:, i), kind=wp), harmonic(:, t)), i=1, size(force)), t=1, size(omega))], &
                       [size(force), size(omega)])
      d = self%states
      self%load_scale = norm2(force)/self%unit
      self%tone = pack([(t, t=1, size(omega))], [(norm2(abs(phasor(:, t))) > 0.0_wp, t=1, size(omega))])
      self%tone_scale = [(norm2(abs(phasor(:, self%tone(t))))/self%unit, t=1, size(self%tone))]
      nx = d + merge(1, 0, self%load_scale > 0.0_wp) + 2*size(self%tone)
      allocate (self%matrix(nx, nx), source=0.0_wp)
      associate (s => size(modes%phi, 2))
         do i = 1, s
            self%matrix(i, s + i) = self%unit
         end do
         self%matrix(s + 1:d, :s) = -modes%stiffness/self%unit
         self%matrix(s + 1:d, s + 1:d) = -modes%damping
      end associate
      associate (driven => self%matrix(d - size(force) + 1:d, :))
         if (self%load_scale > 0.0_wp) driven(:, d + 1) = force/self%load_scale
         do t = 1, size(self%tone)
            i = nx - 2*(size(self%tone) - t) - 1
            driven(:, i) = real(phasor(:, self%tone(t)))/self%tone_scale(t)
            driven(:, i + 1) = -aimag(phasor(:, self%tone(t)))/self%tone_scale(t)
            self%matrix(i, i + 1) = slope(self%tone(t)) - omega(self%tone(t))
            self%matrix(i + 1, i) = omega(self%tone(t))
         end do
      end associate
      self%norm = maxval(sum(abs(self%matrix), dim=1))
   end subroutine new_dense_part

   !> x (nx) at the state z (2m) and tone phasors.
   pure subroutine start(self, z, phasor, x)
      class(dense_part_t), intent(in) :: self
      real(wp), intent(in) :: z(:)
      complex(wp), intent(in) :: phasor(:)
      real(wp), intent(out) :: x(:)

      integer :: i, m, s, t

      m = size(z)/2
      s = size(self%phi, 2)
      x(:s) = matmul(z(:m), self%phi)*self%unit
      x(s + 1:2*s) = matmul(z(m + 1:), self%phi)
      if (self%load_scale > 0.0_wp) x(self%states + 1) = self%load_scale
      do t = 1, size(self%tone)
         i = size(x) - 2*(size(self%tone) - t) - 1
         x(i) = self%tone_scale(t)*phasor(self%tone(t))%re
         x(i + 1) = self%tone_scale(t)*phasor(self%tone(t))%im
      end do
   end subroutine start

   !> Add these modes to the state z (2m).
   pure subroutine add_state(self, x, z)
      class(dense_part_t), intent(in) :: self
      real(wp), intent(in) :: x(:)
      real(wp), intent(inout) :: z(:)

      integer :: m, s

      m = size(self%phi, 1)
      s = size(self%phi, 2)
      z(:m) = z(:m) + matmul(self%phi, x(:s))/self%unit
      z(m + 1:) = z(m + 1:) + matmul(self%phi, x(s + 1:2*s))
   end subroutine add_state

   !> Rows r_p (nx, 0:highest) with d^p/dt^p (a·y + b·y') = r_p·x, a and b (m).
   pure subroutine row(self, a, b, rows)
      class(dense_part_t), intent(in) :: self
      real(wp), intent(in) :: a(:), b(:)
      real(wp), intent(out) :: rows(:, 0:)

      integer :: i, p, s

      rows = 0.0_wp
      s = size(self%phi, 2)
      rows(:s, 0) = [(felt(a, self%phi(:, i))/self%unit, i=1, s)]
      rows(s + 1:2*s, 0) = [(felt(b, self%phi(:, i)), i=1, s)]
      do p = 1, ubound(rows, 2)
         rows(:, p) = matmul(rows(:, p - 1), self%matrix)
      end do
   end subroutine row

end module razy_exact_closed_form_dense_part
