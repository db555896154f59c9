!! Motion while contacts hold constraints (closed rigid stops, sticking friction), in coordinates in which it is free.
!!
!! With constraints w_cᵀ y'' + e_c'' = 0, their forces λ = Λ (Wᵀ a + e''), a the acceleration without them, and the directions D
!! in which these act (friction that slides under a rigid contact included), razy_hybrid_constraints,
!!
!!     y'' = P a - D Λ e'',   P = I - D Λ Wᵀ.
!!
!! R is an orthonormal basis of the range of W and Q of its complement. ξ = Rᵀ y is known: ξ = ξ0 + ν t - S e(t), S the inverse of
!! Wᵀ R, with the constant rate ν = -S c of sticking contacts that are driven with the speed c (a belt). The rest, η = Qᵀ y,
!! obeys η'' + B_q η' + K_q η + K_r ξ + B_r ξ' = f_q with K_q = Qᵀ P K Q, K_r = Qᵀ P K R and so on. With K_q a = -K_r and
!! K_q b = -(B_q a + B_r) the coordinates x = (η - a ξ - b ν, ξ) are not coupled any more:
!!
!!     y = T x + y0,   T = (Q, R + Q a),   y0 = Q b ν,
!!
!! and x'' + B_x x' + K_x x = f_x is an equation like that of free motion, in which the ξ are rigid modes. Where K_q is not
!! symmetric or has slow modes that ξ moves, a = b = 0 and the coupling stays in K_x and B_x, which are then not symmetric.
module razy_exact_constrained_motion
   use razy_core_kinds, only: wp
   use razy_hybrid_linear_form, only: linear_form_t
   implicit none(type, external)
   private

   public :: held_t

   !> Coordinates (m) of a state with constraints (n, of rank r).
   type :: held_t
      integer :: m = 0, n = 0, rank = 0
      !> Whether constraint forces exist; whether a and b are used.
      logical :: found = .true., apart = .true.
      !> Numbers of the contacts that hold (n); friction that slides under one of them: its contact, the row of the constraint, and
      !> its force in parts of that of the constraint.
      integer, allocatable :: contact(:), sliding(:), row(:)
      real(wp), allocatable :: share(:)
      !> T and its inverse (m, m), y0 (m).
      real(wp), allocatable :: from_x(:, :), to_x(:, :), y0(:)
      !> Λ (n, n), Λ Wᵀ (n, m), D Λ (m, n), S (r, n), Q (m, m - r), R (m, r), Qᵀ P (m - r, m).
      real(wp), allocatable :: lambda(:, :), pull(:, :), push(:, :), settle(:, :), q(:, :), r(:, :), left(:, :)
      !> a (m - r, r), and B_q a + B_r (m - r, r).
      real(wp), allocatable :: follow(:, :), drag(:, :)
   contains
      procedure :: projected
      procedure :: transform_matrices
      procedure :: load_of
      procedure :: harmonic_of
      procedure :: form_of
      procedure :: reaction
      procedure :: to_coordinates
      procedure :: to_state
   end type held_t

contains

   !> Qᵀ P A V. What is rounding of its terms is nothing: the stiffness between bodies that are held together is none of the free
   !> motion, which would have a slow mode else where it has a rigid one.
   pure function projected(self, a, v) result(product)
      class(held_t), intent(in) :: self
      real(wp), intent(in) :: a(:, :), v(:, :)
      real(wp) :: product(size(self%left, 1), size(v, 2))

      product = matmul(self%left, matmul(a, v))
      where (abs(product) <= 16*self%m*epsilon(1.0_wp)*matmul(abs(self%left), matmul(abs(a), abs(v)))) product = 0.0_wp
   end function projected

   !> K_x and B_x (m, m) from K and B.
   subroutine transform_matrices(self, k, b)
      class(held_t), intent(in) :: self
      real(wp), intent(inout) :: k(:, :), b(:, :)

      real(wp) :: kx(self%m, self%m), bx(self%m, self%m)

      kx = 0.0_wp
      bx = 0.0_wp
      associate (free => self%m - self%rank)
         kx(:free, :free) = self%projected(k, self%q)
         bx(:free, :free) = self%projected(b, self%q)
         if (self%apart) then
            kx = 0.5_wp*(kx + transpose(kx))
         else
            kx(:free, free + 1:) = self%projected(k, self%r)
            bx(:free, free + 1:) = self%drag
         end if
      end associate
      k = kx
      b = bx
   end subroutine transform_matrices

   !> The constant part of f_x (m) under the load (m).
   pure function load_of(self, load) result(in_x)
      class(held_t), intent(in) :: self
      real(wp), intent(in) :: load(:)
      real(wp) :: in_x(self%m)

      in_x = 0.0_wp
      in_x(:self%m - self%rank) = matmul(self%left, load)
   end function load_of

   !> Phasors of f_x (m, tones) under the loads `harmonic` (m, tones) and the errors (n, tones) of the constraints.
   pure function harmonic_of(self, harmonic, error, omega) result(in_x)
      class(held_t), intent(in) :: self
      complex(wp), intent(in) :: harmonic(:, :), error(:, :)
      real(wp), intent(in) :: omega(:)
      complex(wp) :: in_x(self%m, size(omega))

      complex(wp) :: along(self%rank)
      integer :: t

      associate (free => self%m - self%rank)
         do t = 1, size(omega)
            along = matmul(self%settle, error(:, t))
            in_x(:free, t) = matmul(self%left, harmonic(:, t)) &
                             + omega(t)**2*(matmul(matmul(self%push, error(:, t)), self%q) - matmul(self%follow, along))
            if (self%apart) in_x(:free, t) = in_x(:free, t) + cmplx(0.0_wp, omega(t), wp)*matmul(self%drag, along)
            in_x(free + 1:, t) = omega(t)**2*along
         end do
      end associate
   end function harmonic_of

   !> A form on y as one on x, which it is where nothing is held.
   pure function form_of(self, form) result(in_x)
      class(held_t), intent(in) :: self
      type(linear_form_t), intent(in) :: form
      type(linear_form_t) :: in_x

      if (self%n == 0) then
         in_x = form
         return
      end if
      in_x%on_y = matmul(form%on_y, self%from_x)
      in_x%on_v = matmul(form%on_v, self%from_x)
      in_x%constant = form%constant + dot_product(form%on_y, self%y0)
      in_x%error = form%error
   end function form_of

   !> The force of constraint i as a form on y, from K, B, load and phasors without constraints, and the errors (n, tones).
   pure function reaction(self, i, k, b, load, harmonic, error, omega) result(form)
      class(held_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: k(:, :), b(:, :), load(:), omega(:)
      complex(wp), intent(in) :: harmonic(:, :), error(:, :)
      type(linear_form_t) :: form

      integer :: t

      form%on_y = -matmul(self%pull(i, :), k)
      form%on_v = -matmul(self%pull(i, :), b)
      form%constant = dot_product(self%pull(i, :), load)
      form%error = [(sum(self%pull(i, :)*harmonic(:, t)) - omega(t)**2*sum(self%lambda(i, :)*error(:, t)), t=1, size(omega))]
   end function reaction

   !> Coordinates x and rates (2m) of the state z = (y, y').
   pure function to_coordinates(self, z) result(x)
      class(held_t), intent(in) :: self
      real(wp), intent(in) :: z(:)
      real(wp) :: x(size(z))

      x(:self%m) = matmul(self%to_x, z(:self%m) - self%y0)
      x(self%m + 1:) = matmul(self%to_x, z(self%m + 1:))
   end function to_coordinates

   !> The state (y, y') of coordinates x and their rates (2m).
   pure function to_state(self, x) result(z)
      class(held_t), intent(in) :: self
      real(wp), intent(in) :: x(:)
      real(wp) :: z(size(x))

      z(:self%m) = self%y0 + matmul(self%from_x, x(:self%m))
      z(self%m + 1:) = matmul(self%from_x, x(self%m + 1:))
   end function to_state

end module razy_exact_constrained_motion
