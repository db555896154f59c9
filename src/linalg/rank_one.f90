!! Eigenvalues of a diagonal matrix changed by a product of two vectors, all in conjugate pairs: D - l rᵀ.
!!
!! With the poles λ_i (Im > 0) and their conjugates, weights g_i = l_i r_i and, if there is a mode without stiffness, a double
!! pole at 0 with weights a/s + c/s², the eigenvalues are the roots of
!!
!!     f(s) = 1 + Σ_i (g_i/(s - λ_i) + conj(g_i)/(s - conj(λ_i))) + a/s + c/s².
!!
!! All roots are sought at once by the iteration of Ehrlich (Commun. ACM 10 (1967) 107–108) and Aberth (Math. Comp. 27 (1973)
!! 339–344) on f times its denominators. A root is kept as its nearest pole and the offset from it, so that s - λ_i has no
!! cancellation however close a root stays to a pole (Gu and Eisenstat, SIAM J. Matrix Anal. Appl. 16 (1995) 172–191).
!! A real eigenvalue, which has no partner above the real axis, is not represented: the iteration then fails and says so.
module razy_linalg_rank_one
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: rank_one_roots, root_t

   !> A root: `pole` is the number of its pole, 0 the double pole at 0, and `offset` its distance from there, 1/s.
   type :: root_t
      integer :: pole = 0
      complex(wp) :: offset = (0.0_wp, 0.0_wp)
   contains
      procedure :: minus
   end type root_t

   integer, parameter :: most_rounds = 80
   real(wp), parameter :: eps = epsilon(1.0_wp)

contains

   !> Roots (n, or n + 1 with a double pole) above the real axis; `found` tells that each makes f vanish to rounding, and that the
   !> sums of the roots and of their squares are the traces of D - l rᵀ and of its square.
   !>
   !> `pole`, `weight` (n) with weight /= 0; `double` (2) are a and c, 0 if there is no double pole.
   pure subroutine rank_one_roots(pole, weight, double, root, found)
      complex(wp), intent(in) :: pole(:), weight(:)
      real(wp), intent(in) :: double(2)
      type(root_t), intent(out) :: root(:)
      logical, intent(out) :: found

      complex(wp) :: change, value(size(root))
      real(wp) :: trace(2), pull
      integer :: i, round
      logical :: settled(size(root))

      call start(pole, weight, double, root)
      settled = .false.
      found = .false.
      do round = 1, most_rounds
         do i = 1, size(root)
            if (settled(i)) cycle
            call correction(pole, weight, double, root, i, change, settled(i))
            if (.not. abs(change) <= huge(1.0_wp)) return
            call move(root(i), pole, change)
            if (abs(change) <= eps*abs(root(i)%offset)) settled(i) = .true.
         end do
         if (all(settled)) exit
      end do
      if (.not. all(settled)) return
      value = [(root(i)%minus((0.0_wp, 0.0_wp), pole), i=1, size(root))]
      pull = 2*sum(real(weight)) + double(1)
      trace = [2*sum(real(value)) - 2*sum(real(pole)) + pull, &
               2*sum(real(value**2)) - 2*sum(real(pole**2)) + 4*sum(real(weight*pole)) + 2*double(2) - pull**2]
      found = abs(trace(1)) <= 64*eps*(sum(abs(value)) + sum(abs(pole)) + sum(abs(weight)) + abs(double(1))) .and. &
              abs(trace(2)) <= 64*eps*(sum(abs(value)**2) + sum(abs(pole)**2) + sum(abs(weight*pole)) + abs(double(2)) + pull**2)
   end subroutine rank_one_roots

   !> First values: each pole moved by what its own term alone would move it, but not further than to half of the next pole; for
   !> the double pole the frequency of its own two terms.
   pure subroutine start(pole, weight, double, root)
      complex(wp), intent(in) :: pole(:), weight(:)
      real(wp), intent(in) :: double(2)
      type(root_t), intent(out) :: root(:)

      ! Off the line on which poles and roots without damping lie.
      complex(wp), parameter :: aside = (0.96_wp, 0.28_wp)
      complex(wp) :: value, slope, poles
      real(wp) :: nearest, total
      integer :: i, j

      do i = 1, size(pole)
         call rest(pole, weight, double, root_t(i, (0.0_wp, 0.0_wp)), value, slope, total, poles)
         root(i)%pole = i
         root(i)%offset = -weight(i)/value
         nearest = 2*abs(aimag(pole(i)))
         do j = 1, size(pole)
            if (j /= i .and. abs(pole(i) - pole(j)) > 0.0_wp) nearest = min(nearest, abs(pole(i) - pole(j)))
         end do
         if (abs(root(i)%offset) > 0.5_wp*nearest) root(i)%offset = 0.5_wp*nearest*aside*root(i)%offset/abs(root(i)%offset)
      end do
      if (size(root) > size(pole)) root(size(root)) = root_t(0, cmplx(0.0_wp, sqrt(abs(double(2))), wp)*aside)
   end subroutine start

   !> What the iteration adds to root i; `settled` if f is rounding there.
   pure subroutine correction(pole, weight, double, root, i, change, settled)
      complex(wp), intent(in) :: pole(:), weight(:)
      real(wp), intent(in) :: double(2)
      type(root_t), intent(in) :: root(:)
      integer, intent(in) :: i
      complex(wp), intent(out) :: change
      logical, intent(out) :: settled

      complex(wp) :: value, slope, others, z
      real(wp) :: total
      integer :: j

      z = root(i)%offset
      call rest(pole, weight, double, root(i), value, slope, total, others)
      ! phi = g + z*rest has the root of f without its pole.
      if (root(i)%pole > 0) then
         slope = value + z*slope
         value = weight(root(i)%pole) + z*value
         total = abs(weight(root(i)%pole)) + abs(z)*total
      end if
      settled = abs(value) <= 2*eps*total
      do j = 1, size(root)
         if (j /= i) others = others - 1.0_wp/difference(pole, root(i), root(j))
         others = others - 1.0_wp/root(i)%minus(conjg(root(j)%minus((0.0_wp, 0.0_wp), pole)), pole)
      end do
      change = (0.0_wp, 0.0_wp)
      if (abs(value) > 0.0_wp) change = -value/(slope + value*others)
   end subroutine correction

   !> f without the term of the root's own pole, its slope, the sum of the moduli of its terms, and the sum of 1/(s - λ) over all
   !> other poles.
   pure subroutine rest(pole, weight, double, at, value, slope, total, poles)
      complex(wp), intent(in) :: pole(:), weight(:)
      real(wp), intent(in) :: double(2)
      type(root_t), intent(in) :: at
      complex(wp), intent(out) :: value, slope, poles
      real(wp), intent(out) :: total

      complex(wp) :: near, far, s
      integer :: k

      value = (1.0_wp, 0.0_wp)
      slope = (0.0_wp, 0.0_wp)
      poles = (0.0_wp, 0.0_wp)
      total = 1.0_wp
      do k = 1, size(pole)
         far = 1.0_wp/at%minus(conjg(pole(k)), pole)
         poles = poles + far
         total = total + magnitude(weight(k)*far)
         value = value + conjg(weight(k))*far
         slope = slope - conjg(weight(k))*far*far
         if (k == at%pole) cycle
         near = 1.0_wp/at%minus(pole(k), pole)
         poles = poles + near
         total = total + magnitude(weight(k)*near)
         value = value + weight(k)*near
         slope = slope - weight(k)*near*near
      end do
      if (.not. any(abs(double) > 0.0_wp)) return
      s = at%minus((0.0_wp, 0.0_wp), pole)
      poles = poles + 2.0_wp/s
      value = value + (double(1) + double(2)/s)/s
      slope = slope - (double(1) + 2*double(2)/s)/s**2
      total = total + (abs(double(1)) + magnitude(double(2)/s))/magnitude(s)
   end subroutine rest

   !> Within a factor of sqrt(2) of the modulus.
   elemental function magnitude(z) result(size)
      complex(wp), intent(in) :: z
      real(wp) :: size

      size = max(abs(real(z)), abs(aimag(z)))
   end function magnitude

   !> Root minus `point`.
   pure function minus(self, point, pole) result(distance)
      class(root_t), intent(in) :: self
      complex(wp), intent(in) :: point, pole(:)
      complex(wp) :: distance

      distance = self%offset - point
      if (self%pole > 0) distance = (pole(self%pole) - point) + self%offset
   end function minus

   !> a - b.
   pure function difference(pole, a, b) result(distance)
      complex(wp), intent(in) :: pole(:)
      type(root_t), intent(in) :: a, b
      complex(wp) :: distance

      distance = a%offset - b%offset
      if (a%pole > 0) distance = distance + pole(a%pole)
      if (b%pole > 0) distance = distance - pole(b%pole)
      if (a%pole > 0 .and. b%pole > 0) distance = (pole(a%pole) - pole(b%pole)) + (a%offset - b%offset)
   end function difference

   !> Add `change`; a root stays above the real axis, and is counted from the pole that is nearest.
   pure subroutine move(root, pole, change)
      type(root_t), intent(inout) :: root
      complex(wp), intent(in) :: pole(:), change

      complex(wp) :: s
      integer :: k, nearest
      real(wp) :: least

      root%offset = root%offset + change
      s = root%minus((0.0_wp, 0.0_wp), pole)
      if (aimag(s) < 0.0_wp) then
         s = conjg(s)
         root%offset = s
         if (root%pole > 0) root%offset = s - pole(root%pole)
      end if
      nearest = root%pole
      least = 0.5_wp*abs(root%offset)
      do k = 1, size(pole)
         ! Most are told without a root.
         if (.not. (magnitude(s - pole(k)) < least .and. abs(s - pole(k)) < least)) cycle
         nearest = k
         least = abs(s - pole(k))
      end do
      if (nearest == root%pole) return
      root%offset = root%minus(pole(nearest), pole)
      root%pole = nearest
   end subroutine move

end module razy_linalg_rank_one
