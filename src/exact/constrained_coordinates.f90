!! The coordinates in which the motion is free while contacts hold constraints: razy_exact_constrained_motion has their equations.
module razy_exact_constrained_coordinates
   use razy_core_kinds, only: wp
   use razy_hybrid_constraints, only: constraints_t
   use razy_exact_constrained_motion, only: held_t
   use razy_linalg_eigen, only: symmetric_eigen
   implicit none(type, external)
   private

   public :: new_held

   !> Modes of K_q below this part of the largest are slow.
   real(wp), parameter :: slow = 1.0e-8_wp
   !> A coupling below this part of its terms is rounding.
   real(wp), parameter :: rounding = 1.0e-13_wp

contains

   !> The coordinates for `constraints` with the directions `w` (m, contacts) of all contacts and the coefficients `phi` of the
   !> friction that the constraints press; `k` and `b` (m, m) are those of motion without constraints, `drive` (n) the speeds c.
   subroutine new_held(self, constraints, w, phi, k, b, drive)
      type(held_t), intent(out) :: self
      type(constraints_t), intent(in) :: constraints
      real(wp), intent(in) :: w(:, :), phi(:), k(:, :), b(:, :), drive(:)

      real(wp) :: d(size(w, 1), constraints%count), unit(constraints%count)
      integer :: i, m, n

      m = size(w, 1)
      n = constraints%count
      self%m = m
      self%n = n
      self%rank = constraints%rank
      self%contact = constraints%contact(:n)
      self%sliding = constraints%sliding(:constraints%couplings)
      self%row = constraints%row(:constraints%couplings)
      self%share = constraints%sign(:constraints%couplings)*phi
      d = w(:, self%contact)
      do i = 1, constraints%couplings
         d(:, constraints%row(i)) = d(:, constraints%row(i)) + constraints%sign(i)*phi(i)*w(:, constraints%sliding(i))
      end do
      allocate (self%lambda(n, n), self%from_x(m, m), self%to_x(m, m))
      do i = 1, n
         unit = 0.0_wp
         unit(i) = 1.0_wp
         call constraints%solve(unit, phi, self%lambda(:, i), self%found)
         if (.not. self%found) return
      end do
      self%pull = matmul(self%lambda, transpose(w(:, self%contact)))
      self%push = matmul(d, self%lambda)
      call find_bases(self, constraints, w(:, self%contact))
      self%left = transpose(self%q)
      if (constraints%couplings > 0) self%left = self%left - matmul(matmul(self%left, self%push), transpose(w(:, self%contact)))
      call separate(self, k, b, drive)
      associate (free => m - self%rank)
         self%from_x(:, :free) = self%q
         self%from_x(:, free + 1:) = self%r + matmul(self%q, self%follow)
         self%to_x(:free, :) = transpose(self%q) - matmul(self%follow, transpose(self%r))
         self%to_x(free + 1:, :) = transpose(self%r)
      end associate
   end subroutine new_held

   !> R, Q and S; Q are the last columns of Householder's reflections that take R to the first unit vectors.
   subroutine find_bases(self, constraints, w)
      type(held_t), intent(inout) :: self
      type(constraints_t), intent(in) :: constraints
      real(wp), intent(in) :: w(:, :)

      real(wp) :: mirror(self%m, self%rank), rest(self%m, self%rank), square, twice(self%rank)
      integer :: i, j

      allocate (self%r(self%m, self%rank), self%q(self%m, self%m - self%rank), self%settle(self%rank, self%n))
      do i = 1, self%rank
         associate (v => constraints%range(:, i))
            square = dot_product(v, matmul(constraints%gram, v))
            self%r(:, i) = matmul(w, v)/sqrt(square)
            self%settle(i, :) = v/sqrt(square)
         end associate
      end do
      rest = self%r
      mirror = 0.0_wp
      do i = 1, self%rank
         mirror(i:, i) = rest(i:, i)
         mirror(i, i) = mirror(i, i) + sign(norm2(rest(i:, i)), rest(i, i))
         ! Not normalised, so that unit vectors stay what they are.
         twice(i) = 2/dot_product(mirror(:, i), mirror(:, i))
         do j = i, self%rank
            rest(:, j) = rest(:, j) - mirror(:, i)*(twice(i)*dot_product(mirror(:, i), rest(:, j)))
         end do
      end do
      self%q = 0.0_wp
      do j = 1, self%m - self%rank
         self%q(self%rank + j, j) = 1.0_wp
         do i = self%rank, 1, -1
            self%q(:, j) = self%q(:, j) - mirror(:, i)*(twice(i)*dot_product(mirror(:, i), self%q(:, j)))
         end do
      end do
   end subroutine find_bases

   !> a, b and y0, or none of them.
   subroutine separate(self, k, b, drive)
      type(held_t), intent(inout) :: self
      real(wp), intent(in) :: k(:, :), b(:, :), drive(:)

      real(wp) :: kq(self%m - self%rank, self%m - self%rank), bq(self%m - self%rank, self%m - self%rank)
      real(wp) :: kr(self%m - self%rank, self%rank), lag(self%m - self%rank, self%rank)
      real(wp) :: phi(self%m - self%rank, self%m - self%rank), square(self%m - self%rank)
      logical :: firm(self%m - self%rank), possible
      integer :: info

      associate (free => self%m - self%rank)
         allocate (self%follow(free, self%rank), self%drag(free, self%rank), source=0.0_wp)
         allocate (self%y0(self%m), source=0.0_wp)
         if (free == 0) return
         kq = self%projected(k, self%q)
         bq = self%projected(b, self%q)
         kr = self%projected(k, self%r)
         self%drag = self%projected(b, self%r)
         lag = 0.0_wp
         self%apart = all(abs(kq - transpose(kq)) <= rounding*maxval(abs(kq)))
         if (self%apart) then
            phi = kq
            call symmetric_eigen(phi, square, info)
            self%apart = info == 0
            firm = abs(square) > slow*maxval(abs(square))
         end if
         if (self%apart) then
            call divide(kr, maxval(abs(k)), self%follow, possible)
            self%apart = possible
            self%drag = self%drag + matmul(bq, self%follow)
            call divide(self%drag, maxval(abs(b))*(1.0_wp + maxval(abs(self%follow))), lag, possible)
            self%apart = self%apart .and. possible
         end if
         if (self%apart) then
            self%y0 = -matmul(self%q, matmul(lag, matmul(self%settle, drive)))
         else
            self%follow = 0.0_wp
            self%drag = self%projected(b, self%r)
         end if
      end associate

   contains

      !> x with K_q x = -right in firm modes; not possible if `right`, a sum of terms of `size_of`, moves others.
      subroutine divide(right, size_of, x, possible)
         real(wp), intent(in) :: right(:, :), size_of
         real(wp), intent(out) :: x(:, :)
         logical, intent(out) :: possible

         real(wp) :: modal(size(right, 1), size(right, 2))
         integer :: i

         modal = matmul(transpose(phi), right)
         possible = .true.
         do i = 1, size(square)
            if (firm(i)) then
               modal(i, :) = -modal(i, :)/square(i)
            else
               possible = possible .and. all(abs(modal(i, :)) <= rounding*size_of)
               modal(i, :) = 0.0_wp
            end if
         end do
         x = matmul(phi, modal)
      end subroutine divide

   end subroutine separate

end module razy_exact_constrained_coordinates
